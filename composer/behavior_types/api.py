"""The types of the API for behaviors, read from :mod:`composer.behavior`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from functools import cache

from composer import behavior
from composer.fast_dataclass import dataclass

_AWAITABLE = re.compile(r"Awaitable\[(\w+)\]")

#: Classes whose values a behavior gets from the composer.
API_CLASSES = frozenset(
    name
    for name, item in vars(behavior).items()
    if inspect.isclass(item) and getattr(item, "_is_protocol", False) and name != "Protocol"
)
#: All names that behaviors may import from ``composer.behavior``.
API_NAMES = frozenset(
    name
    for name, item in vars(behavior).items()
    if name == "Changes" or getattr(item, "__module__", None) == behavior.__name__
)
#: The attributes that the composer sets, without those of Python itself.
BEHAVIOR_ATTRIBUTES = tuple(name for name in behavior.Behavior.__slots__ if name[0] != "_")


@dataclass(frozen=True, slots=True)
class Member:
    """An attribute or a method of a class of the API, and the annotation of its value.

    ``is_async`` is true if a call returns an awaitable; ``annotation`` is then what it gives.
    """

    name: str
    annotation: str
    is_method: bool
    is_async: bool = False


@cache
def members(class_name: str) -> Mapping[str, Member]:
    """Return the members of a class of the API."""
    found = {}
    for name, item in vars(getattr(behavior, class_name)).items():
        if name.startswith("_"):
            continue
        is_method = inspect.isfunction(item)
        function = item.fget if isinstance(item, property) else item
        annotation = getattr(function, "__annotations__", {}).get("return", "Any")
        awaited = _AWAITABLE.fullmatch(annotation)
        found[name] = Member(
            name, awaited[1] if awaited else annotation, is_method, is_async=awaited is not None
        )
    return found


def attribute_class(name: str) -> str | None:
    """Return the API class of ``self.<name>``: Logger and Clock; None for others."""
    annotation = behavior.Behavior.__annotations__.get(name, "")
    return annotation if annotation in API_CLASSES else None
