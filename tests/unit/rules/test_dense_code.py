"""Mistakes in code with operators, iterators, tables and states of its own, and right code."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Diagnostic
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = """\
system: a
nodes:
  n:
    behavior: code:Code
    parameters:
      rates: {type: double_array, default: [1.0, 2.0]}
      mode: {type: string, default: slow, choices: [slow, fast]}
    clients: {stop: {type: std_srvs/srv/Trigger, external: true}}
    action_servers: {drive: {type: composer_interfaces/action/Navigate, external: true}}
    timers: {tick: {period_ms: 100}, tock: {period_ms: 100}}
"""
CODE = """\
import collections
import functools
import itertools
import math
import re
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum, auto
from typing import NamedTuple

import numpy as np
from composer.behavior import Behavior
from composer_interfaces.action import Navigate
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String
from std_srvs.srv import Trigger


class State(StrEnum):
    IDLE = "idle"
    BUSY = "busy"


NAME = re.compile("[a-z]+")
NUMBER = re.compile(r"([0-9]+) *(?P<unit>m|s)")


class Gear(IntEnum):
    LOW = 1


class Mode(Enum):
    SLOW = auto()
    FAST = auto()


class Step(NamedTuple):
    target: State
    reason: str


@dataclass
class Pose:
    x: float
    y: float = 0.0

    def __mul__(self, other: "Pose") -> "Pose":
        return Pose(self.x * other.x)

    def __rsub__(self, other: float):
        return other - self.x

    def distance(self, other: "Pose") -> float:
        return self.x - other.x


class Route:
    def __init__(self, poses: list[Pose]):
        self.poses = poses

    def __iter__(self) -> Iterator[Pose]:
        return iter(self.poses)

    def __getitem__(self, index: int) -> Pose:
        return self.poses[index]

    def by_name(self) -> Mapping[str, Pose]:
        return {}


class Low:
    def __init__(self):
        self.value: float | None = None
        self.started = None

    def start(self):
        {low}


class Code(Behavior):
    def on_configure(self):
        self.pose = Pose(1.0)
        self.route = Route([self.pose])
        self.steps: dict[State, Callable[[], Step | None]] = {State.IDLE: self.idle}
        self.times: dict[str, list[float]] = {}
        {configure}

    def idle(self) -> Step | None:
        return None

    def move(self):
        {move}

    def send(self, label: str, data: str):
        print(label, data)

    def enter(self, step: Step):
        print(step.reason)

    def accept_drive(self, request):
        {accept}
        return True

    async def on_drive(self, goal):
        {drive}
        return Navigate.Result()

    async def on_tick(self):
        {tick}

    def on_tock(self):
        {tock}
"""
PLACES = ("low", "configure", "move", "accept", "drive", "tick", "tock")


def _found(folder: Path, statements: dict[str, str]) -> list[Diagnostic]:
    code = CODE
    for place in PLACES:
        text = statements.get(place, "pass").replace("\n", "\n        ")
        code = code.replace(f"{{{place}}}", text)
    (folder / "code.py").write_text(code, encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)


#: The statements by place, the rule and the text that is underlined.
MISTAKES = [
    # operators and iterators of own classes
    ({"tick": "print((self.pose * self.pose).z)"}, "unknown-attribute", "z"),
    ({"tick": "print((1.0 - self.pose).z)"}, "unknown-field", "z"),
    ({"tick": "self.pose @ self.pose"}, "invalid-value", "self.pose @ self.pose"),
    ({"tick": "for n, p in enumerate(self.route):\n    print(p.z)"}, "unknown-attribute", "z"),
    ({"tick": "print([p.z for p in sorted(self.route)])"}, "unknown-attribute", "z"),
    ({"tick": "for a, b in itertools.pairwise(self.route):\n    a.distance(b.x)"},
     "call-arguments", "b.x"),
    ({"tick": "for p in itertools.chain(self.route, [self.pose]):\n    print(p.z)"},
     "unknown-attribute", "z"),
    ({"tick": "for p in itertools.takewhile(bool, self.route):\n    print(p.z)"},
     "unknown-attribute", "z"),
    # members of enumerations, named tuples
    ({"tick": "self.enter(State.IDLE)"}, "call-arguments", "State.IDLE"),
    ({"tick": "for step in self.steps.values():\n    await step()"}, "invalid-value", "step"),
    # what annotations of dicts and others say
    ({"tick": "steps: dict[State, Callable[[], Step]] = {State.IDLE: self.idle()}"},
     "invalid-value", "self.idle()"),
    ({"tick": "rates: dict[str, float] = {n: n for n in ('a', 'b')}"}, "invalid-value", "n"),
    ({"tick": "names: list[str] = [rate for rate in self.parameters.rates]"},
     "invalid-value", "rate"),
    ({"tick": "last: tuple[float, float] | None = self.parameters.rates[0] or None"},
     "invalid-value", "self.parameters.rates[0]"),
    ({"tick": "times: defaultdict[str, list[float]] = defaultdict(float)"},
     "invalid-value", "defaultdict(float)"),
    ({"tick": "times: defaultdict[str, list[float]] = defaultdict(lambda: 0.0)"},
     "invalid-value", "defaultdict(lambda: 0.0)"),
    # what is not a function
    ({"tick": "min([1], key=self.parameters.rates)"}, "call-arguments", "self.parameters.rates"),
    ({"tick": "functools.partial(self.clients.stop.call(Trigger.Request()))"},
     "call-arguments", "self.clients.stop.call(Trigger.Request())"),
    # lengths and elements of deques
    ({"tick": "deque([1], maxlen=self.parameters.rates)"}, "invalid-value",
     "self.parameters.rates"),
    ({"tick": "collections.deque(20)"}, "invalid-value", "20"),
    # what is never stored
    ({"tick": "self.times['a'].append(1.0)"}, "invalid-value", "'a'"),
    ({"tick": "name = self.name\nself.times[name].append(1.0)"}, "invalid-value", "name"),
    ({"low": "self.value += 0.5", "tick": "Low().start()"}, "unchecked-none", "self.value"),
    ({"low": "self.started -= 0.5", "tick": "Low().start()"}, "unchecked-none", "self.started"),
    ({"tick": "target, reason, other = Step(State.IDLE, 'a')"}, "invalid-value",
     "Step(State.IDLE, 'a')"),
    ({"tick": "for target, reason in [Step(State.IDLE, 'a')]:\n    reason / 2"}, "invalid-value",
     "reason / 2"),
    # where one of several values, or all of them, are wrong
    ({"tick": "text = 'a' if self.pose else 5\nString(data=text)"}, "invalid-value", "5"),
    ({"tick": "text = 4 if self.pose else 5\nString(data=text)"}, "invalid-value", "text"),
    ({"tick": "String(data=math.inf if self.pose else 'a')"}, "invalid-value", "math.inf"),
    ({"tick": "count: Counter[str] = Counter()\nString(data=count['a'])"}, "invalid-value",
     "count['a']"),
    # what is added to a number, what is grouped, mapped, indexed and iterated over
    ({"tick": "start = 0.0\nstart += max(self.clock.__dict__)\nPoseStamped(pose=start)"},
     "invalid-value", "start"),
    ({"tick": "for _, group in itertools.groupby(self.route):\n    len(group)"}, "invalid-value",
     "group"),
    ({"tick": "list(itertools.groupby(self.route, key=lambda p: p.z))"}, "unknown-attribute", "z"),
    ({"tick": "list(itertools.takewhile(lambda p: p.z, self.route))"}, "unknown-attribute", "z"),
    ({"tick": "list(filter(lambda p: p.z, self.route))"}, "unknown-attribute", "z"),
    ({"tick": "print(self.route[0].z)"}, "unknown-attribute", "z"),
    ({"tick": "for name, pose in self.route.by_name().items():\n    pose.z"},
     "unknown-attribute", "z"),
    ({"tick": "for name, pose in self.route.by_name():\n    pose"}, "invalid-value",
     "self.route.by_name()"),
    # members and elements of other types, methods of arrays and dicts
    ({"tick": "Trigger.Response(success=Gear.LOW)"}, "invalid-value", "Gear.LOW"),
    ({"tick": "String(data=Gear.LOW)"}, "invalid-value", "Gear.LOW"),
    ({"tick": "names = ['a']\nRoute(names)"}, "call-arguments", "names"),
    ({"tick": "self.times.update(['a'], [1.0])"}, "call-arguments", "[1.0]"),
    ({"tick": "NAME.search(Step(State.IDLE, 'a'))"}, "invalid-value", "Step(State.IDLE, 'a')"),
    ({"tick": "for n in np.zeros(3).tolist:\n    n"}, "invalid-value", "np.zeros(3).tolist"),
    ({"tick": "PoseStamped().pose = np.zeros(3).tolist()"}, "invalid-value",
     "np.zeros(3).tolist()"),
    ({"tick": "rates: list[float] = []\nrates.append(np.eye(3) @ np.zeros(3))"}, "invalid-value",
     "np.eye(3) @ np.zeros(3)"),
    # groups that a pattern lacks
    ({"tick": "found = NUMBER.match('a')\nif found:\n    found.group(3)"}, "invalid-value", "3"),
    ({"tick": "if found := NUMBER.match('a'):\n    found.group('size')"}, "invalid-value",
     "'size'"),
    ({"tick": "found = NUMBER.search('a')\nif found:\n    a, b, c = found.groups()"},
     "invalid-value", "found.groups()"),
    ({"tick": "found = re.match('(a)', 'a')\nif found:\n    found.start(2)"}, "invalid-value", "2"),
    # what is swapped
    ({"tick": "label, text = 'a', String()\nself.send(text.data, label)"}, "call-arguments",
     "text.data"),
    ({"tick": "Trigger.Response(success='a', message=True)"}, "invalid-value", "'a'"),
    # what is read before it is set
    ({"accept": "return not self.busy and request", "drive": "self.busy = True"},
     "unknown-attribute", "busy"),
    ({"tick": "if self.pose:\n    self.move()", "tock": "self.move()",
      "move": "if self.pose.x:\n    return\nprint(self.since)\nself.since = self.pose.x"},
     "unknown-attribute", "since"),
]  # fmt: skip
RIGHT = [
    {"tick": "print((self.pose * self.pose).x, 1.0 - self.pose + 2.0)"},
    {"tick": "for n, p in enumerate(self.route):\n    print(p.x + n)"},
    {"tick": "print(max(self.route, key=lambda p: p.x).x, len(list(self.route)))"},
    {"tick": "print(State.IDLE.upper(), State.IDLE + 'a', {State.IDLE: 1}['idle'])"},
    {"tick": "step = self.steps[State.IDLE]()\nself.enter(step or Step(State.BUSY, 'a'))"},
    {"tick": "times: defaultdict[str, list[float]] = defaultdict(lambda: [0.0])"},
    {"tick": "times: defaultdict[str, deque] = defaultdict(lambda: deque(maxlen=5))"},
    {"tick": "times: defaultdict[str, float] = defaultdict(int)"},
    {"tick": "min([1], key=None), sorted([1], key=functools.partial(max, 1))"},
    {"tick": "deque([1], maxlen=None), deque((), 5), deque(maxlen=len('a'))"},
    {"tick": "self.times[self.name] = []\nself.times[self.name].append(1.0)"},
    {"tick": "self.times.update(a=[])\nself.times['a'].append(1.0)"},
    {"tick": "if self.name in self.times:\n    self.times[self.name].append(1.0)"},
    {"tick": "self.other = self.more = {}\nself.other['a'] = 1\nprint(self.more['a'])"},
    {"low": "self.value = 1.0\nself.value += 0.5", "tick": "Low().start()"},
    {"low": "self.value += 0.5", "tick": "low = Low()\nlow.value = 1.0\nlow.start()"},
    {"low": "self.value += 0.5", "tick": "low = Low()\nsetattr(low, 'value', 1.0)\nlow.start()"},
    {"accept": "return request and not self.busy", "drive": "self.busy = True"},
    {"accept": "return not self.busy", "drive": "self.busy = True", "tock": "self.busy = False"},
    {"tick": "label, text = 'a', String()\nself.send(label, text.data)"},
    {"tick": "label, data = 'a', 'b'\nself.send(data, label)"},
    {"tick": "a = String()\nlabel = 'a'\nself.send(a.data, label)\nself.send(label, a.data)"},
    {"tick": "String(data=State.IDLE), Route(tuple([self.pose])), Route([Pose(1)])"},
    {"tick": "for _, group in itertools.groupby(self.route):\n    len(list(group))"},
    {"tick": "self.times.update({'a': []}, b=[]), self.times.update([('a', [])])"},
    {
        "tick": "found = NUMBER.match('a')\nif found:\n    a, b = found.groups()\n"
        "    found.group(2), found.group('unit'), found.group(), found.group(0, 1)"
    },
    {"tick": "for axis in 'xy':\n    setattr(self, f'_{axis}', 1.0)\nself._x + self.poses"},
    {"tick": "if hasattr(self, 'poze'):\n    print(self.poze)"},
    {"move": "if not hasattr(self, 'since'):\n    self.since = 1\nprint(self.since)"},
    {"move": "for n in self.route:\n    print(n)\nself.since = 1\nprint(self.since)"},
    {"tick": "try:\n    self.count + 1\nexcept AttributeError:\n    pass\nself.count = 1"},
]


@pytest.mark.parametrize(("statements", "rule", "text"), MISTAKES)
def test_a_mistake_is_reported_once(
    statements: dict[str, str], rule: str, text: str, tmp_path: Path
) -> None:
    [diagnostic] = _found(tmp_path, statements)
    assert diagnostic.rule.name == rule
    assert quoted(diagnostic) == text


@pytest.mark.parametrize("statements", RIGHT)
def test_right_code(statements: dict[str, str], tmp_path: Path) -> None:
    assert _found(tmp_path, statements) == []
