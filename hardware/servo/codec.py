# SPDX-License-Identifier: MIT
"""Between the bytes of a control table, its counts, and SI units.

Negative counts are a two's complement of the register's own size: -1 in two bytes is FF FF.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from .table import XL330, Register

_FORMATS = {(1, False): "B", (2, False): "H", (4, False): "I"}
_FORMATS |= {(size, True): letter.lower() for (size, _), letter in _FORMATS.items()}


def register(name: str) -> Register:
    """The register of that name; an unknown one is a ValueError that lists those alike."""
    if name not in XL330:
        alike = [known for known in XL330 if set(name.split("_")) & set(known.split("_"))]
        raise ValueError(f"no register {name!r}; alike: {', '.join(alike) or ', '.join(XL330)}")
    return XL330[name]


def encode(name: str, count: int) -> bytes:
    """Bytes of a count as they go over the line.

    Raises:
        ValueError: The register cannot be written, or not with this count.
    """
    entry = register(name)
    if not entry.writable:
        raise ValueError(f"{name} can only be read")
    if isinstance(count, bool) or int(count) != count or not entry.low <= count <= entry.high:
        raise ValueError(f"{name} must be a whole number in {entry.low}..{entry.high}, got {count}")
    return int(count).to_bytes(entry.size, "little", signed=entry.signed)


def decode(name: str, data: bytes) -> int:
    """Count that a register's bytes stand for."""
    entry = register(name)
    if len(data) != entry.size:
        raise ValueError(f"{name} has {entry.size} bytes, got {len(data)}")
    return int.from_bytes(data, "little", signed=entry.signed)


def to_si(name: str, count: float) -> float:
    """A count in SI units [rad, rad/s, A, V, s; degrees Celsius for temperatures]."""
    return count * register(name).scale


def from_si(name: str, value: float) -> int:
    """The count nearest to a value in SI units."""
    return round(value / register(name).scale)


class Block:
    """Registers that stand one after the other, read together.

    Attributes:
        names: Their names.
        address: Address of the first.
        size: Bytes of all.
    """

    def __init__(self, names: Sequence[str]) -> None:
        entries = [register(name) for name in names]
        for name, entry, after in zip(names, entries, entries[1:], strict=False):
            if entry.address + entry.size != after.address:
                raise ValueError(f"a block must have no gaps, there is one after {name}")
        self.names = tuple(names)
        self.address = entries[0].address
        self._struct = struct.Struct("<" + "".join(_FORMATS[e.size, e.signed] for e in entries))
        self.size = self._struct.size

    def decode(self, data: bytes) -> dict[str, int]:
        """Counts by register name."""
        return dict(zip(self.names, self._struct.unpack(data), strict=True))
