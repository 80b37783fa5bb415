# SPDX-License-Identifier: MIT
import dataclasses

import pytest
import trimesh
from held_box import HAND_XML, write_grasp

from vtgtsam import HandModel, ObjectModel, read_recording
from vtgtsam.evaluation.given import Given
from vtgtsam.exceptions import RecordingError

MAP = """
hand: hand.xml
object: {mesh: box.stl, scale: 0.001}
topics: {joints: /joint_states, contacts: /tactile/contacts}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "hand.xml").write_text(HAND_XML)
    trimesh.creation.box(extents=[40.0, 60.0, 80.0]).export(tmp_path / "box.stl")
    return tmp_path


def digest(hand=None, obj=None, topics=None):
    return Given.of(hand, obj, topics).digest()


def test_the_digest_follows_the_files_that_a_map_names(folder):
    first = digest(topics=folder / "map.yaml")
    assert digest(topics=folder / "map.yaml") == first
    trimesh.creation.box(extents=[41.0, 60.0, 80.0]).export(folder / "box.stl")
    second = digest(topics=folder / "map.yaml")
    (folder / "hand.xml").write_text(HAND_XML.replace("0.012", "0.013"))
    third = digest(topics=folder / "map.yaml")
    (folder / "map.yaml").write_text(MAP.replace("0.001", "0.0011"))
    assert len({first, second, third, digest(topics=folder / "map.yaml")}) == 4


def test_the_digest_follows_models_in_memory(folder):
    obj = read_recording(write_grasp(folder / "0.mcap", frames=2)).object
    wider = HandModel.from_text(HAND_XML.replace("0.012", "0.013"))
    bare = ObjectModel("box", obj.sdf)
    digests = [
        digest(),
        digest(obj=obj),
        digest(obj=bare),
        digest(obj=dataclasses.replace(bare, name="brick")),
        digest(obj=dataclasses.replace(bare, symmetry={"symmetries_continuous": []})),
        digest(hand=HandModel.from_text(HAND_XML)),
        digest(hand=wider),
    ]
    assert len(set(digests)) == len(digests)
    assert digest(hand=wider) == digests[-1]


def test_the_digest_of_a_file_is_its_contents_wherever_it_lies(folder, monkeypatch):
    first = digest(hand=folder / "hand.xml")
    monkeypatch.chdir(folder)
    assert digest(hand="hand.xml") == first


def test_relative_paths_are_made_absolute_and_names_kept(folder, monkeypatch):
    monkeypatch.chdir(folder)
    given = Given.of("hand.xml", "can", "map.yaml")
    assert given.hand == str(folder / "hand.xml")
    assert given.obj == "can"


def test_a_recording_is_read_with_what_was_given(folder):
    recording = write_grasp(folder / "0.mcap", frames=2)
    assert Given.of(None, None, None).read(recording).object.name == "box"
    obj = ObjectModel("brick", read_recording(recording).object.sdf)
    assert Given.of(None, obj, None).read(recording).object.name == "brick"


def test_a_map_that_cannot_be_read_is_said(tmp_path):
    with pytest.raises(RecordingError, match="missing.yaml"):
        Given.of(None, None, tmp_path / "missing.yaml")


def test_the_digest_follows_pads_files_and_symmetries(folder):
    pads = "pads: [{name: a, body: base, pos: [0, 0, 0], normal: +x, size: [0.02, %s]}]"
    (folder / "pads.yaml").write_text(pads % 0.02)
    (folder / "one.json").write_text('{"symmetries_continuous": [{"axis": [0, 0, 1]}]}')
    (folder / "map.yaml").write_text(
        MAP.replace("scale: 0.001", "scale: 0.001, symmetry: one.json") + "pads: pads.yaml\n"
    )
    digests = [digest(topics=folder / "map.yaml")]
    (folder / "pads.yaml").write_text(pads % 0.03)
    digests.append(digest(topics=folder / "map.yaml"))
    (folder / "one.json").write_text('{"symmetries_continuous": [{"axis": [0, 1, 0]}]}')
    digests.append(digest(topics=folder / "map.yaml"))
    (folder / "models_info.json").write_text("{}")
    digests.append(digest(topics=folder / "map.yaml"))
    assert len(set(digests)) == 4
