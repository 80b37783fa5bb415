# SPDX-License-Identifier: MIT
"""Decoders of ROS 2 messages (CDR, little endian), written out from their definitions as Python functions.

mcap-ros2-support walks through the definition again for each message, which takes five times as long. It parses
the definitions here too, and decodes what is rare: big-endian messages, and definitions with wide strings.

The names in a message hardly change from one to the next: where a block of strings has the bytes of the one
before, it is not decoded again.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import make_dataclass
from typing import Any

from mcap_ros2._dynamic import _for_each_msgdef, generate_dynamic

Decoder = Callable[[bytes], Any]

_CODES = {  # of struct, as mcap-ros2-support reads them
    "bool": "?",
    "byte": "B",
    "char": "b",
    "float32": "f",
    "float64": "d",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
}
_BYTES = ("byte", "uint8")  # whose arrays stay bytes
_START = 4  # [bytes], of the encapsulation's header, after which alignment counts


def generate_decoder(msgtype: str, text: str) -> Decoder:
    """Function from CDR bytes to a message with the definition's fields.

    Args:
        msgtype: Name of the type, such as sensor_msgs/msg/JointState.
        text: Its definition and those it is made of, as MCAP's ros2msg has them.
    """
    careful: Decoder = generate_dynamic(msgtype, text)[msgtype]
    parts: dict[str, Any] = {}
    _for_each_msgdef(msgtype, text, lambda _, short, part: parts.setdefault(short, part))
    package, name = msgtype.split("/")[0], msgtype.split("/")[-1]
    try:
        quick = _Source(parts).function(f"{package}/{name}")
    except (
        KeyError,
        TypeError,
    ):  # a type that is not in the table; a field that Python cannot name
        return careful
    return lambda data: quick(data) if len(data) >= _START and data[1] & 1 else careful(data)


class _Source:
    """The source of one function, as it is written."""

    def __init__(self, parts: dict[str, Any]) -> None:
        self.parts = parts
        self.lines: list[str] = []
        self.names: dict[str, Any] = {"unpack": struct.unpack_from, "strings": strings}
        self.count = 0

    def function(self, short: str) -> Decoder:
        """The decoder of a message type, such as sensor_msgs/JointState."""
        message = self.message(short, " ")
        source = "\n".join(
            ["def decode(data):", f" at = {_START}", *self.lines, f" return {message}"]
        )
        exec(
            source, self.names
        )  # of names and formats alone: the text of a definition is not in it
        return self.names["decode"]  # type: ignore[no-any-return]

    def new(self, value: Any = None) -> str:
        """A name that is not used yet, for a value that the function knows or will find."""
        self.count += 1
        name = f"v{self.count}"
        if value is not None:
            self.names[name] = value
        return name

    def message(self, short: str, indent: str) -> str:
        """Write how a message is read; the name of the variable that then holds it."""
        fields = self.parts[short].fields
        if not fields:  # which ROS 2 fills up with one byte
            self.lines.append(f"{indent}at += 1")
        values = [self.field(field.type, indent) for field in fields]
        make = self.new(
            make_dataclass(short.split("/")[1], [field.name for field in fields], slots=True)
        )
        result = self.new()
        self.lines.append(f"{indent}{result} = {make}({', '.join(values)})")
        return result

    def field(self, kind: Any, indent: str) -> str:
        """Write how a field is read; the name of the variable that then holds it."""
        if not kind.is_array:
            return self.single(kind, indent)
        count = str(kind.array_size) if kind.is_fixed_size_array() else self.numbers("I", indent)
        result = self.new()
        if not kind.is_primitive_type():
            self.lines += [f"{indent}{result} = []", f"{indent}for _ in range({count}):"]
            item = self.message(f"{kind.pkg_name}/{kind.type}", indent + " ")
            self.lines.append(f"{indent} {result}.append({item})")
        elif kind.type == "string":
            last = self.new([b"", []])
            self.lines.append(f"{indent}{result}, at = strings(data, at, {count}, {last})")
        elif kind.type in _BYTES:
            self.lines += [f"{indent}{result} = data[at:at + {count}]", f"{indent}at += {count}"]
        else:
            code = _CODES[kind.type]
            size = struct.calcsize(code)
            self.lines += [
                f"{indent}if {count}: at += ({_START} - at) % {size}",
                f"{indent}{result} = list(unpack(f'<{{{count}}}{code}', data, at))",
                f"{indent}at += {count} * {size}",
            ]
        return result

    def single(self, kind: Any, indent: str) -> str:
        if not kind.is_primitive_type():
            return self.message(f"{kind.pkg_name}/{kind.type}", indent)
        if kind.type != "string":
            return self.numbers(_CODES[kind.type], indent)
        result, last = self.new(), self.new([b"", []])
        self.lines.append(f"{indent}({result},), at = strings(data, at, 1, {last})")
        return result

    def numbers(self, code: str, indent: str) -> str:
        result, size = self.new(), struct.calcsize(code)
        read = self.new(struct.Struct(f"<{code}").unpack_from)
        if size > 1:
            self.lines.append(f"{indent}at += ({_START} - at) % {size}")
        self.lines += [f"{indent}{result}, = {read}(data, at)", f"{indent}at += {size}"]
        return result


def strings(data: bytes, at: int, count: int, last: list[Any]) -> tuple[list[str], int]:
    """Strings from a place on, and the place after them.

    Args:
        data: The message.
        at: Where the first one starts, before alignment.
        count: How many there are.
        last: What was found last time, bytes and strings; it is brought up to date.
    """
    at += (_START - at) % 4
    block, found = last
    if len(found) == count and count and data.startswith(block, at):
        return list(found), at + len(block)
    begin, found = at, []
    for _ in range(count):
        at += (_START - at) % 4
        (length,) = struct.unpack_from("<I", data, at)
        at += 4
        found.append(data[at : at + max(length - 1, 0)].decode())
        at += length
    if at <= len(data):
        last[:] = data[begin:at], found
    return list(found), at
