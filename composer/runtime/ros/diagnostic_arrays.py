"""Serialized messages of diagnostic_msgs/msg/DiagnosticArray, without an object for each value."""

from __future__ import annotations

import math
import struct
import sys
from array import array
from collections.abc import Iterable
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

#: CDR of a plain type: the first byte of the header, and the second one by the order of bytes.
_PLAIN, _ORDERS = 0, {0: "big", 1: "little"}
_LITTLE_ENDIAN = bytes((_PLAIN, 1, 0, 0))
_HEADER, _STAMP = 4, 8
_ALIGNED = 4  # to so many bytes
_NS_PER_S = 10**9
#: Most values are those of the message before, and writing them again takes most of the time.
_KNOWN_VALUES = 4096


class Level(IntEnum):
    """The constants of DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class Status(NamedTuple):
    """A diagnostic status. ``level`` is one of :class:`Level`, or what another node has sent."""

    level: int
    name: str
    message: str
    hardware_id: str
    values: dict[str, str]


def write_array(stamp_ns: int, statuses: Iterable[Status], frame_id: str = "") -> bytes:
    """Return a message with these statuses; ``stamp_ns`` is its time in nanoseconds."""
    statuses = tuple(statuses)
    seconds, nanoseconds = divmod(stamp_ns, _NS_PER_S)
    parts = [
        _LITTLE_ENDIAN,
        struct.pack("<iI", seconds, nanoseconds),
        _padded(frame_id),
        struct.pack("<I", len(statuses)),
    ]
    gap = 0  # until the next aligned position, which the last value leaves
    for status in statuses:
        # The level is a byte, which is not aligned itself.
        parts.append(bytes((status.level,)).ljust(gap or _ALIGNED, b"\0"))
        parts += map(_padded, (status.name, status.message, status.hardware_id))
        parts.append(struct.pack("<I", len(status.values)))
        parts += map(_value, status.values, status.values.values())
        gap = 0
        if status.values:
            last = _string(next(reversed(status.values.values())))
            gap = -len(last) % _ALIGNED
            parts[-1] = parts[-1][: len(parts[-1]) - gap]
    return b"".join(parts)


@lru_cache(_KNOWN_VALUES)
def _value(key: str, value: str) -> bytes:
    return _padded(key) + _padded(value)


def _padded(text: str) -> bytes:
    string = _string(text)
    return string + bytes(-len(string) % _ALIGNED)


def _string(text: str) -> bytes:
    """Return a string of CDR: its length, its characters and a zero."""
    content = text.encode(errors="replace").partition(b"\0")[0] + b"\0"
    return struct.pack("<I", len(content)) + content


def read_array(content: bytes) -> tuple[float, list[Status]]:
    """Return the time of a message in seconds, and its statuses. Raises ValueError."""
    if len(content) < _HEADER or content[0] != _PLAIN or content[1] not in _ORDERS:
        raise ValueError("it is not serialized as CDR")
    words = array("I", content + bytes(-len(content) % _ALIGNED))
    if _ORDERS[content[1]] != sys.byteorder:
        words.byteswap()
    try:
        return words[1] + words[2] * 1e-9, _statuses(words, content.decode("latin-1"))
    except IndexError:
        raise ValueError("it ends early") from None


def _statuses(words: array[int], text: str) -> list[Status]:
    """Return the statuses. Raises IndexError."""
    position = _HEADER + _STAMP
    position = _aligned(position + 4 + words[position // 4])  # the frame id
    count, position = words[position // 4], position + 4
    found = []
    for _ in range(count):
        level = ord(text[position])
        position = _aligned(position + 1)
        name, position = _string_at(position, words, text)
        message, position = _string_at(position, words, text)
        hardware_id, position = _string_at(position, words, text)
        end = position + 4
        values = {}
        for _ in range(words[position // 4]):
            start = (end + 7) & -4  # written out: it takes most of the time
            end = start + words[start // 4 - 1]
            key = text[start : end - 1]
            start = (end + 7) & -4
            end = start + words[start // 4 - 1]
            values[_decoded(key)] = _decoded(text[start : end - 1])
        found.append(Status(level, name, message, hardware_id, values))
        position = end
    return found


def _string_at(position: int, words: array[int], text: str) -> tuple[str, int]:
    """Return a string, and the next position that is aligned."""
    end = position + 4 + words[position // 4]
    return _decoded(text[position + 4 : end - 1]), _aligned(end)


def _aligned(position: int) -> int:
    return (position + 3) & -4


def _decoded(text: str) -> str:
    """Return a text of bytes as the text that they encode."""
    return text if text.isascii() else text.encode("latin-1").decode(errors="replace")


def finite(text: str) -> float:
    """Return a number. Raises ValueError, also for infinity and NaN."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"'{text:.80}' is not a number")
    return number


def whole(text: str) -> int:
    """Return an integer. Raises ValueError."""
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"'{text:.80}' is not an integer") from None


def optional_text(number: float | None, digits: int) -> str:
    """Return a number as text with some digits after the point; empty if it is not known."""
    return "" if number is None else f"{number:.{digits}f}"


def optional(text: str) -> float | None:
    """Return the number of :func:`optional_text`. Raises ValueError."""
    return finite(text) if text else None
