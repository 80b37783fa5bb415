# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from hardware.tactile.frame import (
    Frame,
    FrameError,
    FrameReader,
    FrameVersionError,
    decode,
    encode,
)


def random_frame(rng, inputs=16):
    readings = rng.integers(0, 2**16, inputs) * (rng.random(inputs) < 0.8)  # some zeros
    return Frame(
        int(rng.integers(2**16)), int(rng.integers(2**32)), tuple(int(r) for r in readings)
    )


def damage(packet, rng):
    """One of the ways in which a serial line spoils bytes; the packet without its last zero."""
    data = bytearray(packet)
    kind, at = rng.integers(6), int(rng.integers(len(data)))
    if kind == 0:  # a bit
        data[at] ^= 1 << int(rng.integers(8))
    elif kind == 1:  # some bytes
        for _ in range(int(rng.integers(1, 6))):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
    elif kind == 2:  # an end that is missing
        del data[at:]
    elif kind == 3:  # a byte that is missing
        del data[at]
    elif kind == 4:  # a byte too many
        data.insert(at, int(rng.integers(1, 256)))
    else:  # two bytes in each other's place
        other = int(rng.integers(len(data)))
        data[at], data[other] = data[other], data[at]
    return bytes(data)


def test_a_frame_comes_back_as_it_was_sent():
    rng = np.random.default_rng(0)
    for inputs in (0, 1, 14, 16, 120, 255):  # 255: COBS needs more than one block
        frame = random_frame(rng, inputs)
        wire = encode(frame)
        assert wire.endswith(b"\0") and b"\0" not in wire[:-1]
        assert decode(wire[:-1]) == frame


def test_sixteen_readings_take_45_bytes():
    assert len(encode(Frame(0, 0, (0,) * 16))) == 45


def test_the_bytes_on_the_wire_are_pinned():
    # version 1, type 1, sequence 0x0203, time 0x04050607, one reading 0x0908; CRC by hand below
    payload = bytes([1, 1, 3, 2, 7, 6, 5, 4, 1, 8, 9])
    crc = 0xFFFF
    for byte in payload:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1
            crc &= 0xFFFF
    expected = bytes([14]) + payload + bytes([crc & 0xFF, crc >> 8]) + b"\0"
    assert encode(Frame(0x0203, 0x04050607, (0x0908,))) == expected


def test_no_damage_of_forty_thousand_goes_unnoticed():
    rng = np.random.default_rng(1)
    frames = [random_frame(rng) for _ in range(200)]
    packets = [encode(frame)[:-1] for frame in frames]
    undetected = changed = 0
    while changed < 40_000:
        index = int(rng.integers(len(packets)))
        packet = damage(packets[index], rng)
        if packet == packets[index]:
            continue
        changed += 1
        reader = FrameReader()
        # As it arrives: after a zero, and ended by one; damage may have put zeros inside.
        undetected += len(reader.feed(b"\0" + packet + b"\0"))
    assert undetected == 0


def test_a_stream_gives_the_same_frames_however_it_is_cut():
    rng = np.random.default_rng(2)
    frames = [random_frame(rng) for _ in range(500)]
    stream = b"\0" + b"".join(encode(frame) for frame in frames)
    reader, found = FrameReader(), []
    while stream:
        size = int(rng.integers(1, 100))
        found += reader.feed(stream[:size])
        stream = stream[size:]
    assert found == frames
    assert reader.bad == 0


def test_a_reader_that_comes_late_does_not_call_the_cut_frame_damaged():
    frames = [Frame(i, i, (i, 0, 7)) for i in range(3)]
    stream = b"".join(encode(frame) for frame in frames)
    reader = FrameReader()
    assert reader.feed(stream[4:]) == frames[1:]
    assert reader.bad == 0


def test_a_damaged_frame_is_counted_and_the_next_one_read():
    first, second = encode(Frame(1, 1, (5, 6))), encode(Frame(2, 2, (5, 6)))
    reader = FrameReader()
    assert reader.feed(b"\0" + first[:-4] + b"\0" + second) == [Frame(2, 2, (5, 6))]
    assert reader.bad == 1


def test_noise_without_a_zero_does_not_pile_up():
    reader = FrameReader()
    for _ in range(1000):
        assert reader.feed(b"\xaa" * 100) == []
    frame = Frame(1, 2, (3,))
    assert reader.feed(b"\0" + encode(frame)) == [frame]
    assert len(reader._rest) == 0


def test_another_version_is_named_instead_of_counted_as_damage(monkeypatch):
    monkeypatch.setattr("hardware.tactile.frame.VERSION", 2)
    newer = encode(Frame(1, 2, (3,)))
    monkeypatch.undo()
    with pytest.raises(FrameVersionError, match=r"version 2.*reads version 1.*flash"):
        decode(newer[:-1])


@pytest.mark.parametrize("packet", [b"", b"\x01", b"\x05\x01\x01\x01\x01", b"\xff\x01"])
def test_scraps_are_refused(packet):
    with pytest.raises(FrameError):
        decode(packet)
