"""Runs the checks of users' Python on a text, for a node with one port of each kind."""

from __future__ import annotations

import re
import textwrap
from functools import cache
from pathlib import Path

from composer.base.source import Located
from composer.interfaces import Interfaces
from composer.loading import load_bytes
from composer.model import BehaviorReference, Node
from composer.python_code.checks.node_code import code_problems
from composer.python_code.lookup import find_behavior
from composer.python_code.problems import Problem

SYSTEM = """
system: robot
nodes:
  behavior:
    behavior: nodes:Robot
    parameters:
      limit: {type: integer, default: 3}
      frame: {type: string, default: map}
      mode: {type: string, default: slow, choices: [slow, fast]}
    publishers:
      velocity: {type: geometry_msgs/msg/Twist, qos: command, external: true}
      heartbeat: {type: std_msgs/msg/Bool, qos: command, external: true, always_on: true}
    subscriptions:
      fix: {type: sensor_msgs/msg/NavSatFix, qos: sensor_data, external: true}
      odometry: {type: nav_msgs/msg/Odometry, qos: sensor_data, external: true}
      battery: {type: sensor_msgs/msg/BatteryState, qos: sensor_data, external: true}
    services: {reset: {type: std_srvs/srv/Trigger}}
    clients: {enable: {type: std_srvs/srv/SetBool}}
    action_servers: {fibonacci: {type: example_interfaces/action/Fibonacci}}
    action_clients: {count: {type: example_interfaces/action/Fibonacci}}
    timers: {tick: {period_ms: 100}}
  class: {class: "nodes:Robot"}
"""


@cache
def _nodes() -> dict[str, Node]:
    system = load_bytes(SYSTEM.encode(), Path("/nonexistent"), shown="system.yaml").system
    assert system is not None
    return {node.name.value: node for node in system.nodes}


@cache
def _interfaces() -> Interfaces:
    return Interfaces.load()


def problems(text: str, folder: Path, node: str) -> list[Problem]:
    """Return the problems in the text of a file; ``node`` is ``behavior`` or ``class``."""
    (folder / "pyproject.toml").touch()
    (folder / "nodes.py").write_text(textwrap.dedent(text))
    model = _nodes()[node]
    reference = BehaviorReference(Located("nodes:Robot", model.name.span), folder)
    source = find_behavior(reference)
    assert source.class_found, source.problem
    return list(code_problems(model, source, _interfaces()))


def check(text: str, folder: Path, node: str) -> None:
    """Check that exactly the lines that end with a family are reported.

    ``# VALUE`` at the end of a line expects an error of that family, ``# VALUE?`` a doubt.
    """
    text = textwrap.dedent(text)
    marks = (_MARK.search(line) for line in text.split("\n"))
    expected = [(number, mark[1]) for number, mark in enumerate(marks, start=1) if mark]
    reports = [
        (item.span.line, item.family.name + ("" if item.is_certain else "?"))
        for item in problems(text, folder, node)
    ]
    assert sorted(reports) == expected, f"{sorted(reports)} in\n{text}"


_MARK = re.compile(r"# ([A-Z]+\??)$")
