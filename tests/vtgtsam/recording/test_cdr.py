# SPDX-License-Identifier: MIT
"""Decoders written out from definitions, next to mcap-ros2-support's, which walk through them."""

import string
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

from vtgtsam.recording import messages
from vtgtsam.recording.cdr import generate_decoder

MIXED = """\
bool flag
string word
uint8 small
float64 wide
Part part
Part[] parts
Part[2] both
Empty nothing
string[] words
int16 number
float32[] reals
bool[<=4] bits
byte[] raw
char[3] letters
uint64[2] long
int32 CONSTANT=5
===
MSG: test_msgs/Part
int8 tiny
string<=5 label
int64[] far
===
MSG: test_msgs/Empty
"""
REALS = st.floats(width=32, allow_nan=False)
WORDS = st.text(string.ascii_letters + "äß水", max_size=9)


def signed(bits):
    return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


PARTS = st.fixed_dictionaries(
    {"tiny": signed(8), "label": WORDS.map(lambda word: word[:5]), "far": st.lists(signed(64))}
)
MESSAGES = st.fixed_dictionaries(
    {
        "flag": st.booleans(),
        "word": WORDS,
        "small": st.integers(0, 255),
        "wide": st.floats(allow_nan=False),
        "part": PARTS,
        "parts": st.lists(PARTS, max_size=3),
        "both": st.lists(PARTS, min_size=2, max_size=2),
        "nothing": st.just({}),
        "words": st.lists(WORDS, max_size=4),
        "number": signed(16),
        "reals": st.lists(REALS, max_size=5),
        "bits": st.lists(st.booleans(), max_size=4),
        "raw": st.binary(max_size=5),
        "letters": st.lists(signed(8), min_size=3, max_size=3),
        "long": st.lists(st.integers(0, 2**64 - 1), min_size=2, max_size=2),
    }
)


def plain(message):
    """A message as dictionaries, whichever library decoded it."""
    if hasattr(message, "__slots__"):
        return {name: plain(getattr(message, name)) for name in message.__slots__}
    return [plain(item) for item in message] if isinstance(message, list) else message


DECODE = generate_decoder("test_msgs/msg/Mixed", MIXED)
EXPECTED = generate_dynamic("test_msgs/msg/Mixed", MIXED)["test_msgs/msg/Mixed"]
ENCODE = serialize_dynamic("test_msgs/msg/Mixed", MIXED)["test_msgs/msg/Mixed"]


@settings(max_examples=200, deadline=None)
@given(st.lists(MESSAGES, min_size=1, max_size=4))
def test_messages_of_all_types_are_decoded_as_the_library_does(several):
    # One after the other, and again: names that stay the same are not decoded anew.
    for message in [*several, *several]:
        data = ENCODE(message)
        assert plain(DECODE(data)) == plain(EXPECTED(data))


@settings(max_examples=100, deadline=None)
@given(message=MESSAGES, share=st.floats(0, 1))
def test_message_that_is_cut_off_is_decoded_or_refused_as_the_library_does(message, share):
    data = ENCODE(message)
    cut = data[: int(share * len(data))]
    try:
        expected = plain(EXPECTED(cut))
    except Exception as error:
        with pytest.raises((type(error), struct.error)):
            DECODE(cut)
    else:
        assert plain(DECODE(cut)) == expected
    assert plain(DECODE(data)) == plain(EXPECTED(data))


@pytest.mark.parametrize("msgtype", [messages.JOINT_STATE, messages.TACTILE_PADS])
def test_a_list_of_names_can_be_changed_without_changing_the_next_message(msgtype):
    data = messages.encoder(msgtype)({"name": ["a", "bc"]})
    decode = messages.decoder(msgtype)
    decode(data).name.append("mine")
    decode(data).name.append("mine")
    assert decode(data).name == ["a", "bc"]


def test_big_endian_messages_and_wide_strings_are_left_to_the_library():
    text = "int32 number\nfloat64 wide\n"
    decode = generate_decoder("test_msgs/msg/Pair", text)
    data = b"\x00\x00\x00\x00" + struct.pack(">i4xd", 7, 0.5)
    assert plain(decode(data)) == {"number": 7, "wide": 0.5}
    with pytest.raises(NotImplementedError, match="wstring"):
        generate_decoder("test_msgs/msg/Wide", "wstring word\n")(b"\x00\x01\x00\x00" + bytes(8))
