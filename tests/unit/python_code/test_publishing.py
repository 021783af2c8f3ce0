"""The publishing rates of a node, from its YAML and its behavior."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent, indent
from typing import NamedTuple

import pytest

from composer.analysis import rates as publications
from composer.graph import publishing_rates
from composer.model import BehaviorReference
from composer.python_code.lookup import find_behavior
from composer.source import Located, SourceFile, Span
from tests.unit.support.resolving import system_of

PLACE = Span(SourceFile("robot.yaml"), 1, 1)


class Uses(NamedTuple):
    """The publishers of a method: those of each call, all, and those passed on or stored."""

    always: bool
    anywhere: bool
    passed_on: bool


def uses(body: str, folder: Path) -> Uses:
    """Return how a handler uses the publisher ``out``."""
    text = f"class Robot:\n    def on_tick(self):\n{indent(dedent(body), '        ')}\n"
    (folder / "robot.py").write_text(text)
    source = find_behavior(BehaviorReference(Located("robot:Robot", PLACE), folder))
    (method,) = source.methods
    return Uses(
        always=[*publishing_rates._unconditional(method)].count("out") == 1,
        anywhere="self.publishers.out" in publishing_rates._names(method),
        passed_on=publications._passed_on(source) == {"out"},
    )


@pytest.mark.parametrize(
    "body",
    [
        "self.publishers.out.publish(x)",
        "x = 1\nif x:\n    x = 2\nself.publishers.out.publish(x)",
        "for x in y:\n    z()\nself.publishers.out.publish(x)\nreturn",
        "publish = self.publishers.out.publish\npublish(x)",
        "out = self.publishers.out\nout.publish(x)",
        "publishers = self.publishers\nout = publishers.out\nsend = out.publish\nsend(x)",
    ],
)
def test_unconditional_statements_publish_each_time(body: str, tmp_path: Path) -> None:
    assert uses(body, tmp_path) == (True, True, False)


@pytest.mark.parametrize(
    "body",
    [
        "if x:\n    self.publishers.out.publish(x)",
        "if x:\n    return\nself.publishers.out.publish(x)",
        "for x in y:\n    self.publishers.out.publish(x)",
        "assert x\nself.publishers.out.publish(x)",
        "self.publishers.out.publish(x)\nself.publishers.out.publish(x)",
        "out = self.publishers.out\nif x:\n    out.publish(x)",
        "self.publishers.out.topic",
    ],
)
def test_conditional_publishers_are_only_mentioned(body: str, tmp_path: Path) -> None:
    assert uses(body, tmp_path) == (False, True, False)


@pytest.mark.parametrize(
    "body",
    [
        "send(self.publishers.out)",
        "self.send = self.publishers.out.publish",
        "out = self.publishers.out\nsend(out)",
        "out = self.publishers.out\nout = other\nout.publish(x)",
        "def send(out=self.publishers.out):\n    out.publish(x)",
    ],
)
def test_stored_publishers_may_be_used_anywhere(body: str, tmp_path: Path) -> None:
    assert uses(body, tmp_path) == (False, True, True)


@pytest.mark.parametrize("body", ["out.publish(x)", "self.out.publish(x)", "self.publishers"])
def test_other_attributes_are_not_publishers(body: str, tmp_path: Path) -> None:
    assert uses(body, tmp_path) == (False, False, False)


SENDER = """
    from composer.behavior import Behavior

    class Sender(Behavior):
        def on_tick(self):
            self.publishers.out.publish(self.make())

        def on_other(self):
            pass
"""
SYSTEM = """
    system: sending
    nodes:
      sender:
        behavior: sender:Sender
        publishers: {out: {type: std_msgs/msg/String}}
        timers: {tick: {rate_hz: 20}, other: {rate_hz: 5}}
"""


def rates_hz(folder: Path, python: str = SENDER, system: str = SYSTEM) -> dict[str, float]:
    (folder / "sender.py").write_text(dedent(python))
    (node,) = system_of(system, folder).nodes
    return publishing_rates.publishing_rates_hz(node)


def test_the_rate_is_that_of_the_timer_whose_handler_publishes(tmp_path: Path) -> None:
    assert rates_hz(tmp_path) == {"out": 20.0}


def test_the_rate_is_unknown_if_another_handler_publishes_too(tmp_path: Path) -> None:
    assert rates_hz(tmp_path, SENDER.replace("pass", "self.publishers.out.publish(1)")) == {}


def test_the_rate_is_unknown_if_a_subscription_publishes_too(tmp_path: Path) -> None:
    system = SYSTEM.replace(
        "timers:",
        "subscriptions: {in: {type: std_msgs/msg/String, publish: {out: {}}}}\n        timers:",
    )
    assert rates_hz(tmp_path, SENDER, system) == {}


def test_the_rate_is_unknown_without_a_handler(tmp_path: Path) -> None:
    assert rates_hz(tmp_path, SENDER.replace("on_tick", "on_tock")) == {}
