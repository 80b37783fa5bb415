# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from short_course import shorten

from sim.hands import load_description
from sim.placement import above_palm
from sim.replay import Replay
from sim.scene import OBJECT, WRIST
from sim.simulate import simulate
from sim.world import World
from vtgtsam import load_object


def test_a_replay_shows_hand_and_object_where_they_were(monkeypatch):
    shorten(monkeypatch)
    description = load_description()
    hand = description.load_hand()
    world = World(description, hand, load_object("gelatin_box"))
    trajectory = simulate(world, above_palm(description, world.obj.mesh, np.eye(3), height=0.02))
    assert (
        np.arccos((np.trace(trajectory.T_wh[0, :3, :3].T @ trajectory.T_wh[-1, :3, :3]) - 1) / 2)
        > 0.3
    )
    replay = Replay(world.model, hand.joint_names)
    for k in range(0, len(trajectory.time), 15):
        replay.show(trajectory.joints[k], trajectory.T_wh[k], trajectory.T_wo[k])
        for body, T in ((WRIST, trajectory.T_wh[k]), (OBJECT, trajectory.T_wo[k])):
            shown = replay.data.body(body)
            np.testing.assert_allclose(shown.xmat.reshape(3, 3), T[:3, :3], atol=1e-9)
            np.testing.assert_allclose(shown.xpos, T[:3, 3], atol=1e-9)
        pads = hand.pad_transforms(trajectory.joints[k], trajectory.T_wh[k])
        for name, T_wp in zip(hand.pad_names, pads, strict=True):
            site = replay.data.site(f"hand/{name}")
            np.testing.assert_allclose(site.xmat.reshape(3, 3), T_wp[:3, :3], atol=1e-9)
    assert trajectory.joints.shape[1] == pytest.approx(len(hand.joint_names))
