"""The base class of behaviors has slots, which do not restrict derived classes."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

import pytest

from composer.behavior import Behavior


class Counter(Behavior):
    limit = 3

    def on_configure(self) -> None:
        self.seen = 0


class Named(Behavior):
    name = "until another is set"


@dataclass
class Point(Behavior):
    x: float = 1.0


@pytest.mark.parametrize("kind", [Behavior, Counter, Named, Point])
def test_any_attribute_may_be_set(kind: type[Any]) -> None:
    behavior = kind()
    behavior.publishers = "stands in"
    behavior.name = "/mine"
    behavior.anything = 1
    assert (behavior.publishers, behavior.name, behavior.anything) == ("stands in", "/mine", 1)
    assert weakref.ref(behavior)() is behavior


def test_what_was_not_set_is_missing() -> None:
    with pytest.raises(AttributeError, match="publishers"):
        _ = Counter().publishers
