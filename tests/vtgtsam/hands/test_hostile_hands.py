# SPDX-License-Identifier: MIT
"""Hands that ask for terabytes in a few words, and hands of recordings that name files of this machine."""

import os

import pytest

from vtgtsam.exceptions import HandError
from vtgtsam.hands.model import HandModel
from vtgtsam.hands.pads import Pad, PadSet

PAD = '<body><joint name="j"/><geom size="0.01"/><site name="pad_a" type="box" size="0.01 0.01 0.001"/></body>'


def hand(inside: str = "", body: str = "") -> str:
    return f"<mujoco>{inside}<worldbody>{PAD}{body}</worldbody></mujoco>"


GREEDY = {
    "replicate": hand(body='<replicate count="100000000"><geom size="1"/></replicate>'),
    "nested replicates": hand(
        body='<replicate count="1000"><replicate count="1000"><geom size="1"/></replicate></replicate>'
    ),
    "flexcomp": hand(
        body='<flexcomp type="grid" count="10000 10000 10000" spacing="1 1 1" name="f" dim="3"/>'
    ),
    "hfield": hand(
        '<asset><hfield name="h" nrow="1000000" ncol="1000000" size="1 1 1 1"/></asset>'
    ),
    "texture": hand(
        '<asset><texture name="t" type="2d" builtin="flat" width="900000" height="900000"/></asset>'
    ),
    "memory": hand('<size memory="900G"/>'),
    "user data": hand('<size nuser_body="2000000000"/>'),
    "numeric": hand('<custom><numeric name="n" size="2000000000" data="1"/></custom>'),
    "nan": hand(body='<replicate count="nan"><geom size="1"/></replicate>'),
    "depth": hand(body="<body>" * 5000),
    "entities": '<!DOCTYPE m [<!ENTITY a "b">]>' + hand(),
}


@pytest.mark.parametrize("kind", GREEDY)
def test_a_hand_that_asks_for_too_much_is_refused_before_it_is_compiled(kind, tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(GREEDY[kind])
    for read in (lambda: HandModel.from_mjcf(path), lambda: HandModel.from_text(GREEDY[kind])):
        with pytest.raises(HandError, match=r"more than|declares entities"):
            read()


def test_modest_repetition_is_fine():
    repeated = '<replicate count="20" offset="0.1 0 0"><geom size="0.01"/></replicate>'
    assert len(HandModel.from_text(hand(body=repeated)).pads) == 1


@pytest.mark.parametrize(
    "inside",
    [
        '<include file="/etc/passwd"/>',
        '<asset><mesh name="m" file="/etc/passwd"/></asset>',
        '<asset><texture name="t" type="2d" file="x.png"/></asset>',
        '<asset><texture name="t" type="cube" fileright="x.png"/></asset>',
        '<asset><hfield name="h" file="x.png" size="1 1 1 1"/></asset>',
        '<extension><plugin plugin="mujoco.sdf.torus"/></extension>',
        '<asset><model name="m" file="x.xml"/></asset>',
        '<asset><skin name="s" file="x.skn"/></asset>',
    ],
)
def test_the_hand_of_a_recording_opens_no_file(inside):
    with pytest.raises(HandError, match="opens no file of this machine"):
        HandModel.from_text(hand(inside))


def test_a_hand_file_may_include_others_and_each_counts(tmp_path):
    (tmp_path / "part.xml").write_text(
        '<mujocoinclude><body><geom size="0.01"/></body></mujocoinclude>'
    )
    path = tmp_path / "hand.xml"
    path.write_text(hand(body='<include file="part.xml"/>'))
    assert HandModel.from_mjcf(path).model.ngeom == 2
    path.write_text(hand(body='<replicate count="90000"><include file="part.xml"/></replicate>'))
    with pytest.raises(HandError, match="elements in"):
        HandModel.from_mjcf(path)


def test_a_file_that_includes_itself_is_refused(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(hand(body='<include file="hand.xml"/>'))
    with pytest.raises(HandError, match="includes itself"):
        HandModel.from_mjcf(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="has no pipes")
def test_an_included_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.xml")
    path = tmp_path / "hand.xml"
    path.write_text(hand(body='<include file="pipe.xml"/>'))
    with pytest.raises(HandError, match="no regular file"):
        HandModel.from_mjcf(path)


def test_pads_in_millimetres_are_refused_before_their_grid_is_made():
    with pytest.raises(ValueError, match=r"'p' is 20 x 20 m, more than 0.5 m: .* millimetres"):
        Pad("p", (20, 20))
    with pytest.raises(ValueError, match="more than 0.5 m"):
        Pad("p", (0.02, 1e300))
    Pad("p", (0.5, 0.01))
    with pytest.raises(Exception, match="grid points of all pads are more than"):
        PadSet(Pad(f"p{i}", (0.5, 0.5)) for i in range(5))


def test_a_pad_that_is_nowhere_is_refused():
    for place in ('name="pad_a" pos="nan 0 0"', 'name="pad_a" pos="1e308 1e308 1e308"'):
        with pytest.raises(HandError, match="'pad_a'|finite|nan"):
            HandModel.from_text(hand().replace('name="pad_a"', place)).pad_transforms({"j": 0.0})


def test_a_body_that_is_nowhere_is_refused():
    with pytest.raises(HandError, match="body_pos"):
        HandModel.from_text(hand().replace("<body>", '<body pos="inf 0 0">'))
