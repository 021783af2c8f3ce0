"""A behavior with places for statements."""

from __future__ import annotations

SYSTEM = """\
system: demo
nodes:
  robot:
    behavior: code:Code
    parameters:
      speed: {type: double, default: 1.0}
      names: {type: string_array, default: [a]}
      mode: {type: string, default: fast, choices: [slow, fast]}
      wheel.radius: {type: double, default: 0.1}
    publishers:
      text: {type: std_msgs/msg/String, qos: command, external: true}
      path: {type: nav_msgs/msg/Path, qos: command, external: true}
      charge: {type: sensor_msgs/msg/BatteryState, qos: command, external: true}
    subscriptions:
      odometry: {type: nav_msgs/msg/Odometry, qos: command, external: true}
    services: {reset: {type: std_srvs/srv/Trigger}}
    clients: {stop: {type: std_srvs/srv/Trigger, external: true}}
    action_servers: {drive: {type: composer_interfaces/action/Navigate}}
    action_clients: {turn: {type: composer_interfaces/action/Navigate, external: true}}
"""

CODE = """\
import asyncio
import math
import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from composer_interfaces.action import Navigate
from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.behavior import Behavior, CallError, Goal, SentGoal


NANOSECONDS = 1_000_000_000
NAME = re.compile("[a-z]+")


class Reference:
    def __init__(self, path, limit):
        self.path = path, limit


class Mode(Enum):
    FAST = 1

    @classmethod
    def parse(cls, text):
        return cls[text]


@dataclass
class Statistics:
    frames: int = 0
    scores: list[float] = field(default_factory=list)

    def mean(self) -> float:
        return sum(self.scores)


class Code(Behavior):
    LIMIT = 3
    declared: int

    def on_activate(self):
        self.last = None
        self.count = 0
        self.statistics = Statistics()
        self.other = 0
        self.point: Point | None = None

    def on_odometry(self, message):
        self.last = message
        {odometry}

    def on_reset(self, request, response):
        {reset}
        return response

    async def on_drive(self, goal):
        {drive}

    async def on_configure(self):
        {configure}

    async def turn(self):
        turn = Navigate.Goal()
        await self.action_clients.turn.send_goal(turn, on_feedback=self.on_turning)

    def on_turning(self, feedback):
        {turning}

    async def _wait(self) -> Point:
        await self.clock.sleep(0.1)
        return Point()

    def scale(self, factor: float, name: str = ""):
        return factor

    def keep(self, *anything):
        self.kept = anything

    def keep_rates(self, rates: list[float]):
        self.kept = rates

    @staticmethod
    def first(names, other: str = ""):
        if names is None:
            names = []
        return names.strip()

    @classmethod
    def title(cls):
        return cls.__name__

    def find(self, name) -> Point | None:
        return Point() if name else None

    def use(self, point: Point) -> float:
        return point.x

    def ends(self, name) -> tuple[float, float] | None:
        return (0.0, 1.0) if name else None

    def highest(self) -> float | None:
        return max(self.kept, default=None)

    def find_all(self):
        return [self.find("all")]

    def apply(self, function: Callable[[float], float]) -> float:
        return function(1.0)

    def look(self, point: Point) -> float:
        return point.x if point else 0.0

    def show(self, point: Point | None):
        self.shown = point

    def longest(self):
        found = None
        for name in self.parameters.names:
            found = name if found is None or len(name) > len(found) else found
        return found

    def _text(self) -> str:
        return "text"

    def _follow(self, sent: SentGoal, goal: Goal):
        {follow}


async def wait(stamp: Time):
    {function}
"""
PLACES = ("odometry", "reset", "drive", "configure", "follow", "turning", "function")


def code_with(place: str, statement: str) -> str:
    """Return the code with ``statement`` in ``place``."""
    code = CODE
    for other in PLACES:
        text = statement if other == place else "pass"
        indentation = "    " if other == "function" else "        "
        code = code.replace(f"{{{other}}}", text.replace("\n", f"\n{indentation}"))
    return code
