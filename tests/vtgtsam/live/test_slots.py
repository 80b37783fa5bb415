# SPDX-License-Identifier: MIT
from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam.live.slots import KEPT, NamedSlots, PoseSlot, Slot

HERE, THERE = gtsam.Pose3(), gtsam.Pose3(gtsam.Rot3.Rz(0.1), np.array([0.1, 0.0, 0.0]))


def test_a_slot_holds_its_last_value_at_or_before_an_instant():
    slot = Slot()
    for stamp in (10, 20, 30):
        assert slot.put(stamp, str(stamp))
    held = [slot.held(instant) for instant in (9, 10, 29, 30, 99)]
    assert [sample and sample[1] for sample in held] == [None, "10", "20", "30", "30"]


def test_a_sample_that_is_not_newer_is_refused():
    slot = Slot()
    assert slot.put(20, "first")
    assert not slot.put(20, "again")
    assert not slot.put(10, "older")
    assert slot.held(25) == (20, "first")


def test_a_slot_forgets_what_is_old():
    slot = Slot()
    for stamp in range(5 * KEPT):
        slot.put(stamp, stamp)
    assert len(slot.since(0)) <= 2 * KEPT
    assert slot.held(4 * KEPT) == (4 * KEPT, 4 * KEPT)


def test_publishers_with_some_of_the_names_each_make_one_stream():
    slots = NamedSlots(("a", "b", "c"))
    assert slots.put(10, ("a", "x"), (1.0, 9.0)) == {"a": 1.0}
    assert slots.known_ns is None
    assert slots.missing() == ["b", "c"]
    slots.put(14, ("c", "b"), (3.0, 2.0))
    assert slots.known_ns == 10
    assert slots.latest_ns == 14
    assert slots.behind(12) == ["a"]
    assert slots.held(13) is None  # b and c are not known then
    np.testing.assert_array_equal(slots.held(14), [1.0, 2.0, 3.0])


def test_a_value_that_is_none_costs_its_name_that_sample():
    slots = NamedSlots(("a", "b"))
    slots.put(10, ("a", "b"), (1.0, 2.0))
    assert slots.put(20, ("a", "b"), (np.nan, 3.0)) == {"b": 3.0}
    np.testing.assert_array_equal(slots.held(20), [1.0, 3.0])


def test_what_holds_at_an_instant_begins_what_came_since():
    slots = NamedSlots(("a", "b"))
    slots.put(10, ("a",), (1.0,))
    slots.put(20, ("a", "b"), (2.0, 5.0))
    slots.put(30, ("b",), (6.0,))
    assert slots.since(25) == [(20, {"a": 2.0, "b": 5.0}), (30, {"b": 6.0})]


def test_a_pose_that_never_changes_counts_whatever_its_stamp():
    slot = PoseSlot()
    assert slot.held(0) is None
    slot.put(50, HERE)
    assert slot.held(10).equals(HERE, 0)
    slot.put(60, HERE)
    assert not slot.moves
    slot.put(70, THERE)
    assert slot.moves
    assert slot.held(10) is None
    assert slot.held(65).equals(HERE, 0)
    assert slot.held(70).equals(THERE, 0)
