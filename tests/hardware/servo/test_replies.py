# SPDX-License-Identifier: MIT
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hardware.emulate.packets import status
from hardware.servo.replies import Reply, in_order, parse


def replies(*ids, data=b"new"):
    return [Reply(i, 0, data, 0.0) for i in ids]


def test_a_status_packet_is_taken_apart():
    assert parse(list(status(13, 0x84, b"\x01\x02")), 7.0) == Reply(13, 0x84, b"\x01\x02", 7.0)
    assert parse(list(status(1, 0)), 7.0) == Reply(1, 0, b"", 7.0)


def test_bytes_left_behind_by_unstuffing_are_no_data():
    raw = [*status(13, 0, b"\x01\x02"), 99]
    assert parse(raw, 7.0) == Reply(13, 0, b"\x01\x02", 7.0)


def test_a_packet_too_short_for_a_status_is_none():
    assert parse([0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 0x55, 0, 0], 7.0) is None


def test_replies_in_turn_all_count():
    assert list(in_order(replies(1, 2, 3), [1, 2, 3])) == [1, 2, 3]


def test_a_missing_reply_hides_no_other():
    assert set(in_order(replies(1, 3), [1, 2, 3])) == {1, 3}


def test_a_reply_that_came_before_its_turn_is_of_an_earlier_question():
    arrived = [*replies(3, data=b"old"), *replies(1, 2)]
    assert set(in_order(arrived, [1, 2, 3])) == {1, 2}


def test_of_two_replies_of_one_servo_the_later_one_counts():
    arrived = [*replies(1), *replies(2, data=b"old"), *replies(2, 3)]
    assert {i: reply.data for i, reply in in_order(arrived, [1, 2, 3]).items()} == {
        1: b"new",
        2: b"new",
        3: b"new",
    }


@given(st.lists(st.integers(1, 15), max_size=8))
def test_old_replies_before_the_new_ones_never_count(old):
    asked = list(range(1, 16))
    arrived = [*replies(*old, data=b"old"), *replies(*asked)]
    assert all(reply.data == b"new" for reply in in_order(arrived, asked).values())
