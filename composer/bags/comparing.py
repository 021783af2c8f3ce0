"""Compares the messages of two bags, field by field."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rclpy.serialization import deserialize_message

from composer.bags.bag import NANOSECONDS, BagError, BagMessage
from composer.base.fast_dataclass import dataclass
from composer.model.names import matches_wildcard
from composer.runtime.ros.messages import MessageError, interface_class, to_plain


@dataclass(frozen=True, slots=True)
class Tolerances:
    """What counts as equal.

    ``value`` is a difference of numbers, ``time_s`` of the times of two messages; with infinity,
    only their order counts. ``ignored`` are patterns of fields, such as ``header.stamp.*``.
    """

    value: float = 0.0
    time_s: float = math.inf
    ignored: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Difference:
    """The first difference on a topic, ``at_s`` after the start of the expected bag."""

    at_s: float
    topic: str
    number: int
    text: str

    def __str__(self) -> str:
        return f"{self.at_s:.6f} s  {self.topic}  message {self.number}: {self.text}"


def decoded(message: BagMessage, type_name: str) -> Any:
    """Return the message as an object of rclpy. Raises BagError."""
    try:
        kind = interface_class(type_name)
    except MessageError as error:
        raise BagError(f"'{message.topic}': {error}", error.hint) from error
    try:
        return deserialize_message(message.data, kind)
    except Exception as error:  # classes of the RMW implementation, which are not public
        text = f"'{message.topic}' has {len(message.data)} bytes that are not a {type_name}"
        raise BagError(text) from error


def differences(
    expected: Iterable[BagMessage],
    actual: Iterable[BagMessage],
    types: Mapping[str, str],
    start_ns: int,
    tolerances: Tolerances,
) -> list[Difference]:
    """Return the first difference of each topic, the earliest first.

    The n-th message of a topic is compared with its n-th message in the other bag. Both bags count
    time from ``start_ns``. Raises BagError for types that are not installed.
    """
    ours, theirs = _by_topic(expected), _by_topic(actual)
    found = []
    for topic in sorted(ours.keys() | theirs.keys()):
        pairs = _compared(ours[topic], theirs[topic], types[topic], start_ns, tolerances)
        first = next(pairs, None)
        if first is not None:
            at_s, number, text = first
            found.append(Difference(at_s, topic, number, text))
    return sorted(found, key=lambda item: item.at_s)


def _by_topic(messages: Iterable[BagMessage]) -> defaultdict[str, list[BagMessage]]:
    found: defaultdict[str, list[BagMessage]] = defaultdict(list)
    for message in messages:
        found[message.topic].append(message)
    return found


def _compared(
    expected: list[BagMessage],
    actual: list[BagMessage],
    type_name: str,
    start_ns: int,
    tolerances: Tolerances,
) -> Iterator[tuple[float, int, str]]:
    """Yield the time, the number and the text of each difference."""
    for number, (one, other) in enumerate(zip(expected, actual, strict=False), 1):
        at_s = (one.recorded_ns - start_ns) / NANOSECONDS
        late_s = (other.recorded_ns - one.recorded_ns) / NANOSECONDS
        if abs(late_s) > tolerances.time_s:
            yield at_s, number, f"comes {abs(late_s):.6f} s {'later' if late_s > 0 else 'earlier'}"
        if one.data == other.data:
            continue
        plain = to_plain(decoded(one, type_name)), to_plain(decoded(other, type_name))
        for text in _fields(*plain, "", tolerances):
            yield at_s, number, text
    if len(expected) != len(actual):
        longer = expected if len(expected) > len(actual) else actual
        number = min(len(expected), len(actual))
        at_s = (longer[number].recorded_ns - start_ns) / NANOSECONDS
        yield at_s, number + 1, f"expected {len(expected)} messages, found {len(actual)}"


def _fields(one: Any, other: Any, path: str, tolerances: Tolerances) -> Iterator[str]:
    if any(matches_wildcard(pattern, path) for pattern in tolerances.ignored):
        return
    if isinstance(one, dict):
        for name, value in one.items():
            yield from _fields(value, other[name], f"{path}.{name}".lstrip("."), tolerances)
    elif isinstance(one, list):
        if len(one) != len(other):
            yield f"{path}: expected {len(one)} items, found {len(other)}"
        for index, (left, right) in enumerate(zip(one, other, strict=False)):
            yield from _fields(left, right, f"{path}[{index}]", tolerances)
    elif not _is_equal(one, other, tolerances.value):
        yield f"{path}: expected {one!r}, found {other!r}"


def _is_equal(one: Any, other: Any, tolerance: float) -> bool:
    if one == other:
        return True
    if isinstance(one, float) and isinstance(other, float):
        return (math.isnan(one) and math.isnan(other)) or abs(one - other) <= tolerance
    is_number = isinstance(one, int) and isinstance(other, int) and not isinstance(one, bool)
    return is_number and abs(one - other) <= tolerance
