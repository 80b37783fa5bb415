# SPDX-License-Identifier: MIT
"""The second built-in hand: other axes, joints and pads, and the same code."""

import mujoco
import numpy as np
import pytest
from graphics_needed import needs_graphics
from short_course import FRAMES, shorten

from sim import constants as c
from sim import sequence
from sim.hands import load_description
from sim.look.sheet import contact_sheet
from sim.placement import above_palm
from sim.sequence import SequenceName, Settings, make_sequence
from sim.simulate import simulate
from sim.world import World
from vtgtsam import evaluate, load_object, read_recording


@pytest.fixture(scope="module")
def world():
    description = load_description("fourfinger")
    return World(description, description.load_hand(), load_object("can"))


def test_it_differs_from_the_isyhand_in_what_hands_differ_in(world):
    isyhand = load_description("isyhand").load_hand()
    assert len(world.hand.joint_names) == 16 and len(world.hand.pads) == 14
    assert world.hand.pad_names != isyhand.pad_names
    T_hp = world.hand.pad_transforms(np.zeros(16))
    palm, finger, thumb = (
        T_hp[world.hand.pad_names.index(f"pad_{name}"), :3, 2]
        for name in ("palm_left", "index_distal", "thumb_distal")
    )
    np.testing.assert_allclose([palm, finger], [(1, 0, 0)] * 2, atol=1e-6)
    np.testing.assert_allclose(thumb, (0, 0, 1), atol=1e-6)  # towards the fingers


def test_it_is_stable_under_random_commands(world):
    world.place(above_palm(world.description, world.obj.mesh, np.eye(3)))
    rng = np.random.default_rng(0)
    for _ in range(20):
        world.command(rng.uniform(*world.limits.T), rng.uniform(0.0, c.TURN_ANGLE))
        for _ in range(50):
            world.step()
    assert not any(world.data.warning[kind].number for kind in range(mujoco.mjtWarning.mjNWARNING))
    assert np.isfinite(world.data.qpos).all()


def test_closing_brings_the_pads_of_fingers_and_thumb_towards_each_other(world):
    hand, names = world.hand, world.hand.pad_names
    closed = {name: 0.8 for name in world.description.ranks()}
    still = {name: 0.0 for name in hand.joint_names}

    def gap(joints):
        T_hp = hand.pad_transforms(still | joints)
        return np.linalg.norm(
            T_hp[names.index("pad_index_distal"), :3, 3]
            - T_hp[names.index("pad_thumb_distal"), :3, 3]
        )

    assert gap(closed) < 0.6 * gap({})


def test_it_holds_a_can_that_lies_across_its_palm_through_the_turn(world):
    lying = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # the can's axis along the knuckles
    trajectory = simulate(world, above_palm(world.description, world.obj.mesh, lying))
    assert trajectory.contacts[-1].sum() >= 3
    assert trajectory.contacts[-1][world.on_fingers].sum() >= 2
    np.testing.assert_allclose(  # fingers 45 degrees up, towards the camera
        trajectory.T_wh[-1, :3, :3] @ (0, 0, 1), (np.sqrt(0.5), 0, np.sqrt(0.5)), atol=2e-3
    )
    assert np.quantile(trajectory.overlap[trajectory.contacts], 0.95) < 0.0003


@pytest.fixture
def recording(tmp_path, monkeypatch):
    shorten(monkeypatch)
    sequence._world.cache_clear()
    path = tmp_path / "can_0.mcap"
    settings = Settings(dataset="vary", hand="fourfinger", tracker="depth-hand")
    make_sequence(settings, SequenceName("can", 0), {1.0: path})
    sequence._world.cache_clear()
    return path


def test_its_recordings_are_evaluated_by_themselves(recording, tmp_path):
    read = read_recording(recording)
    assert read.hand.name == read.info["hand"] == "fourfinger"
    assert len(read.measurements()[0].contacts) == 14
    summary = evaluate(recording, ["vis", "vis+tac+pen"], "tuned", tmp_path / "out")
    assert set(summary["method"]) == {"vis", "vis+tac+pen"}
    assert 0 < len(read.measurements()) <= FRAMES


@needs_graphics
def test_its_recordings_are_drawn(recording):
    sheet = contact_sheet(recording, 1, (160, 120))
    assert sheet[30:90, 40:120].std() > 15
