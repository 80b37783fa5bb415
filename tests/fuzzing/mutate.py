# SPDX-License-Identifier: MIT
"""Changes to bytes, from a flipped bit to a number that nobody expects."""

from __future__ import annotations

import re
import struct

import numpy as np

NUMBERS = (
    b"0", b"-1", b"1", b"nan", b"-inf", b"inf", b"1e308", b"-1e-320", b"1e999", b"65536", b"2147483648",
    b"-9223372036854775809", b"18446744073709551616", b"9" * 5000, b"0.0000001", b"",
)  # fmt: skip
WORDS = (
    b"[" * 3000, b"{" * 3000, b"<a>" * 3000, b"\n  no problems found\n", b"\x1b[2J", "\u202e".encode(), b"\xff\xfe",
    b"../../../etc/passwd", b"/dev/zero", b"$\\frac{", b"%s%n{}", b"&a [*a]", b"!!python/name:os.system ",
    b'<include file="/dev/zero"/>', b'<replicate count="99999999">', b"\x00", b"\r", b"x" * 5000, b"true", b"null",
)  # fmt: skip
INTEGERS = (
    0,
    1,
    2**7 - 1,
    2**8 - 1,
    2**15 - 1,
    2**16 - 1,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**63 - 1,
    2**64 - 1,
)

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_TOKEN = re.compile(rb"[A-Za-z_][\w.-]*|[\[\]{}<>:,=\"'/]")


def mutated(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    """The data with one to four changes; ``others`` are spliced in at times."""
    for _ in range(1 + rng.integers(4)):
        if not data:
            break
        data = _CHANGES[rng.integers(len(_CHANGES))](data, others, rng)
    return data[: 1 << 22]


def _place(data: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(len(data)))


def _flip(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for _ in range(1 + rng.integers(3)):
        changed[_place(data, rng)] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _set(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    changed[_place(data, rng)] = int(rng.integers(256))
    return bytes(changed)


def _integer(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    size, value = (1, 2, 4, 8)[rng.integers(4)], INTEGERS[rng.integers(len(INTEGERS))]
    at = _place(data, rng)
    return data[:at] + struct.pack("<Q", value)[:size] + data[at + size :]


def _cut(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    return data[: _place(data, rng)]


def _remove(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    at, length = _place(data, rng), int(rng.integers(1, 64))
    return data[:at] + data[at + length :]


def _repeat(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    at, length = _place(data, rng), int(rng.integers(1, 256))
    times = (1, 2, 50)[rng.integers(3)]
    return data[:at] + data[at : at + length] * times + data[at:]


def _splice(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    other = others[rng.integers(len(others))]
    return data[: _place(data, rng)] + other[_place(other, rng) :]


def _number(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    return _replaced(data, _NUMBER, NUMBERS, rng)


def _word(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    if rng.random() < 0.5:
        return _replaced(data, _TOKEN, WORDS, rng)
    at = _place(data, rng)
    return data[:at] + WORDS[rng.integers(len(WORDS))] + data[at:]


def _swap(data: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    if len(lines) > 2:
        i, j = rng.integers(len(lines), size=2)
        lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _replaced(data: bytes, what: re.Pattern[bytes], by: tuple[bytes, ...], rng) -> bytes:
    found = list(what.finditer(data))
    if not found:
        return data
    match = found[rng.integers(len(found))]
    return data[: match.start()] + by[rng.integers(len(by))] + data[match.end() :]


_CHANGES = (_flip, _set, _integer, _cut, _remove, _repeat, _splice, _number, _number, _word, _swap)
