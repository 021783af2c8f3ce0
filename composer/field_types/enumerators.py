"""The constants of a message that are the values of one of its fields."""

from __future__ import annotations

from collections.abc import Mapping

from composer.interfaces import Message

#: Maximum number of names in a hint.
_SHOWN = 6
#: Words in the names of constants that are limits, not values of a field.
_LIMITS = frozenset({"COUNT", "DEFAULT", "LENGTH", "MAX", "MIN", "NUM", "SIZE", "VERSION"})


def enumerators(message: Message, field: str) -> Mapping[str, int]:
    """Return the constants that are named after the field: STATUS_IDLE for ``status``.

    Without any, they are all constants of the message if only this field has their type.
    """
    numbers = [item for item in message.constants if isinstance(item.value, int)]
    named = [item for item in numbers if item.name.startswith(f"{field.upper()}_")]
    types = {item.type for item in message.constants}
    alike = [item.name for item in message.fields if item.type in types]
    if not named and len(numbers) > 1 and len(types) == 1 and alike == [field]:
        named = numbers
    if any(_LIMITS.intersection(item.name.split("_")) for item in named):
        return {}
    return {item.name: item.value for item in named if isinstance(item.value, int)}


def enumerator_problem(message: Message, field: str, value: object) -> tuple[str, str] | None:
    """Return that a number is none of the constants for a field, and a hint; None if it may be."""
    if not isinstance(value, int) or isinstance(value, bool):
        return None
    known = enumerators(message, field)
    if not known or value in known.values() or _is_combination(value, set(known.values())):
        return None
    names = [f"{number} {name}" for name, number in known.items()]
    more = ", ..." if len(names) > _SHOWN else ""
    text = f"{message.name} has no constant for '{field}' with the value {value}"
    return text, f"valid here: {', '.join(names[:_SHOWN])}{more}"


def _is_combination(value: int, known: set[int]) -> bool:
    """Return whether the constants are flags and ``value`` is a combination of them."""
    flags = known - {0}
    if not all(flag > 0 and flag.bit_count() == 1 for flag in flags) or max(flags, default=0) < 4:
        return False
    return value & ~sum(flags) == 0
