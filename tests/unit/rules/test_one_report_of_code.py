"""A mistake in Python code, or between it and a system, is one report, where it was made."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import Places, places_in

TALK = "{type: std_msgs/msg/String, qos: command"
HELPER = """\
system: a
nodes:
  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}
"""
CODE = "from %s import step\n\n\nclass Code:\n    def on_tick(self):\n        step()\n"
DRIVE = "node: drive\nbehavior: drive:Drive\ntransforms: {dynamic: {base: {parent: odom}}}\n"
DRIVE_CODE = "class Drive:\n    def on_configure(self): ...\n"
ACTION = """\
from example_interfaces.action import Fibonacci


class Code:
    async def on_go(self, goal):
        request: Fibonacci.Goal = goal
        return Fibonacci.Result(sequence=[request.order])
"""
RECIPE = """\
from dataclasses import dataclass


@dataclass
class Recipe:
    @classmethod
    def load(cls, name):
        return cls()


class Code:
    def on_tick(self): Recipe.fetch("a")
"""
SERVER = """\
system: a
nodes:
  n:
    behavior: code:Code
    action_servers:
      go: {type: example_interfaces/action/Fibonacci, external: true}
"""
LOOP = """\
from example_interfaces.action import Fibonacci


class Code:
    async def on_go(self, goal) -> Fibonacci.Result:
        for step in range(goal.request.order):
            await self.clock.sleep(0.1)
            if goal.is_cancel_requested:
                return Fibonacci.Result()
"""
ECHO_BY_CODE = f"""\
system: a
nodes:
  n:
    behavior: code:Code
    subscriptions: {{in: {TALK}, external: true}}}}
    publishers: {{out: {TALK}, external: true}}}}
"""
NUMBER = """\
class Code:
    def on_in(self, message):
        share = 1.0 if message.data else 0.0
        self.publishers.out.publish(share)
"""
EMPTY = """\
from std_srvs.srv import Empty


class Code:
    def on_in(self, message: Empty): ...
"""
CLASS_PORT = """\
system: a
nodes:
  n:
    class: talker:Talker
    publishers: {chater: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /x, from: n.chatter}
"""
TALKER = """\
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.chatter = self.create_publisher(String, "chatter", 10)
"""
METER = """\
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn


class Meter(LifecycleNode):
    def __init__(self, **kwargs):
        super().__init__("meter", **kwargs)

    def on_configure(self):
        self.get_logger().info(state.label)
        return TransitionCallbackReturn.SUCCESS
"""
IMPORTED = """\
from composer.behavior import %s


class Code:
    def on_tick(self):
        try:
            pass
        except CallError:
            pass
"""
BATTERY = """\
from rclpy.node import Node


class Battery(Node):
    def __init__(self):
        super().__init__("battery")
        print(self.get_parameter("period").value)
"""

MISTAKES: dict[str, tuple[dict[str, str], Places]] = {
    "a module that a package of the project lacks": (
        {
            "system.yaml": HELPER,
            "code.py": CODE % "drive.contrl",
            "drive/__init__.py": "",
            "drive/control.py": "def step(): ...\n",
        },
        [("unknown-import", "code.py", 1)],
    ),
    "a cycle of a node type and the system": (
        {
            "system.yaml": "system: a\nnodes:\n  d: {type: drive}\n"
            "  map: {external: true, transforms: {static: {odom: {parent: base}}}}\n",
            "nodes/drive.yaml": DRIVE,
            "nodes/drive.py": DRIVE_CODE,
        },
        [("conflicting-transforms", "system.yaml", 4)],
    ),
    "a handle for a message": (
        {
            "system.yaml": "system: a\nnodes:\n  n:\n    behavior: code:Code\n    action_servers:\n"
            "      go: {type: example_interfaces/action/Fibonacci, external: true}\n",
            "code.py": ACTION,
        },
        [("type-error", "code.py", 6)],
    ),
    "a class attribute that a class lacks": (
        {"system.yaml": HELPER, "code.py": RECIPE},
        [("missing-attribute", "code.py", 12)],
    ),
    "a handler of an action that ends with a loop": (
        {"system.yaml": SERVER, "code.py": LOOP},
        [("missing-return", "code.py", 5)],
    ),
    "what every class has": (
        {"system.yaml": HELPER, "code.py": RECIPE.replace('fetch("a")', "mro()")},
        [],
    ),
    "a number for a message": (
        {"system.yaml": ECHO_BY_CODE, "code.py": NUMBER},
        [("wrong-message-type", "code.py", 4)],
    ),
    "a service that annotates a message": (
        {"system.yaml": ECHO_BY_CODE.replace("String", "Empty"), "code.py": EMPTY},
        [("wrong-message-type", "code.py", 5)],
    ),
    "a port that a class and a connection name otherwise": (
        {"system.yaml": CLASS_PORT, "talker.py": TALKER},
        [("class-port", "system.yaml", 5)],
    ),
    "a transition of a class without its argument": (
        {"system.yaml": "system: a\nnodes:\n  n: {class: 'meter:Meter'}\n", "meter.py": METER},
        [("handler-signature", "meter.py", 8)],
    ),
    "a lifecycle node as a behavior": (
        {
            "system.yaml": "system: a\nnodes:\n  n: {behavior: 'meter:Meter'}\n",
            "meter.py": METER.replace("(self):", "(self, state):"),
        },
        [("wrong-class", "system.yaml", 3)],
    ),
    "an import whose name was to be another one": (
        {"system.yaml": HELPER, "code.py": IMPORTED % "CallFailed"},
        [("unknown-import", "code.py", 1)],
    ),
    "a class without its declaration": (
        {
            "system.yaml": "system: a\nnodes:\n"
            "  n: {class: 'battery:Battery', parameters: {period: 1.0}}\n",
            "battery.py": BATTERY,
        },
        [("undeclared-parameter", "battery.py", 7)],
    ),
    "a module of a package of the project": (
        {
            "system.yaml": HELPER,
            "code.py": CODE % "drive.control",
            "drive/__init__.py": "",
            "drive/control.py": "def step(): ...\n",
        },
        [],
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_in_code_is_reported_once(name: str, tmp_path: Path) -> None:
    files, expected = MISTAKES[name]
    assert places_in(files, tmp_path) == expected
