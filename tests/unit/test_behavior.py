"""The base class of behaviors has slots, which do not restrict derived classes."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

import pytest

import composer.typed
from composer.behavior import Behavior
from composer.typed import ArmBehavior
from composer.typed import PlannerBehavior as Base


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


def test_every_class_of_composer_typed_is_the_base_class() -> None:
    assert ArmBehavior is Base is Behavior


@pytest.mark.parametrize("name", ["Planner", "planner_behavior", "_Behaviors"])
def test_composer_typed_has_nothing_else(name: str) -> None:
    with pytest.raises(AttributeError, match=name):
        getattr(composer.typed, name)
