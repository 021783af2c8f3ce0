"""Mistakes in the code of nodes as people write it, with numpy, dataclasses and actions."""

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
      goal: {type: double_array, default: [1.0, 2.0, 0.5]}
      gain: {type: double, default: 0.5}
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
    subscriptions: {ranges: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
    clients: {enable: {type: std_srvs/srv/SetBool, external: true}}
    action_clients:
      left: {type: composer_interfaces/action/Navigate, external: true}
      right: {type: composer_interfaces/action/Navigate, external: true}
"""
CODE = """\
import functools
import heapq
import math
import time
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Deque, NamedTuple, Optional, TypedDict

import numpy as np
from composer_interfaces.action import Navigate
from geometry_msgs.msg import Point, Pose, PoseStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image, LaserScan, NavSatFix
from std_msgs.msg import ColorRGBA, Header
from std_srvs.srv import SetBool


HOME = (47.0, 8)


class Cluster(NamedTuple):
    x: float
    size: int


@dataclass
class Battery:
    capacity: float
    level: float = field(init=False)

    def __post_init__(self) -> None:
        self.level = self.capacity


@dataclass(frozen=True)
class Spot:
    x: float
    y: float

    def moved(self, dx: float) -> "Spot":
        return replace(self, x=self.x + dx)


@dataclass
class Route:
    spots: list[Spot] = field(default_factory=list)

    @property
    def current(self) -> Spot | None:
        return self.spots[0] if self.spots else None


class Section(TypedDict):
    name: str
    width: float


@functools.lru_cache(maxsize=4)
def slices(count: int, width: float) -> tuple[float, ...]:
    return tuple(at * width for at in range(count))


class Code:
    def on_configure(self):
        self.positions = np.zeros(6)
        self.kernel = np.ones(3) / 3
        self.times: Deque[float] = deque(maxlen=3)
        self.queue: list[tuple[int, Point]] = []
        self.battery = Battery(1.0)
        self.clusters: list[Cluster] = []
        self.route = Route([Spot(0.0, 0.0)])
        self.goal = tuple(self.parameters.goal)

    async def on_ranges(self, message: LaserScan):
        {statement}

    def move(self, share: float):
        start = self.positions.copy()
        self.positions = start + share * (self.kernel - start)

    def filtered(self, message: LaserScan) -> np.ndarray:
        ranges = np.asarray(message.ranges, dtype=np.float32)
        valid = np.isfinite(ranges) & (ranges > message.range_min)
        ranges = np.where(valid, ranges, np.inf)
        return np.convolve(ranges, self.kernel, mode="same")

    def on_activate(self):
        self.last = 0.0

    async def drive(self, speed: float) -> float:
        await self.clock.sleep(1.0)
        return speed
"""
#: The statement and the text that is underlined.
MISTAKES = [
    # arrays of numpy in conditions
    ("if not self.kernel:\n    pass", "self.kernel"),
    ("if self.kernel == 0.5:\n    pass", "self.kernel == 0.5"),
    ("np.isfinite(self.kernel) and (self.kernel > 1.0)", "np.isfinite(self.kernel)"),
    ("0.0 < self.kernel < 1.0", "self.kernel"),
    # their attributes and methods, also where an array is computed from itself
    ("ranges = np.asarray(message.ranges)\nranges = np.where(ranges > 1.0, ranges, 1.0)\n"
     "ranges.average()", "average"),
    ("self.positions.to_list()", "to_list"),
    ("self.kernel.mean(axes=1)", "axes"),
    ("self.kernel.tolist(1)", "1"),
    ("np.sum(self.kernel, axes=0)", "axes"),
    ("out = LaserScan()\nout.range_max = self.kernel > 1.0", "self.kernel > 1.0"),
    ("self.publishers.scan.publish(np.convolve(self.kernel, self.kernel))",
     "np.convolve(self.kernel, self.kernel)"),
    # values that one of several expressions has
    ("client = self.action_clients.left if message.ranges else self.action_clients.right\n"
     "await client.send_goal(Point())", "Point()"),
    ("_, point = heapq.heappop(self.queue)\nPose(position=point.x)", "point.x"),
    ("self.times.add(1.0)", "add"),
    ("0.05 * self.clusters[0].count", "0.05 * self.clusters[0].count"),
    ("Battery()", "Battery"),
    ("Battery(1.0, 2.0)", "2.0"),
    ("total = 0.0\ntotal += self.drive(1.0)", "self.drive"),
    # how many values there are
    ("x, y = self.goal", "self.goal"),
    ("x, y = range(3)", "range(3)"),
    ("pose = Odometry()\npose.pose.covariance = [0.0, *self.parameters.goal]",
     "[0.0, *self.parameters.goal]"),
    # fields of messages
    ("full = np.zeros((6, 6))\npose = Odometry()\npose.pose.covariance = full", "full"),
    ("pose = Odometry()\npose.pose.covariance = np.eye(6).tolist()", "np.eye(6).tolist()"),
    ("pixels = np.random.default_rng().integers(0, 9, size=(4, len(self.queue), 3))\n"
     "Image(data=pixels)", "pixels"),
    ("ColorRGBA(r=1, g=0, b=0, a=0.5)", "1"),
    ("Image().data = [300] * 4", "300"),
    ("fix = NavSatFix()\nfix.latitude, fix.longitude = (1.0, 2)", "2"),
    ("fix = NavSatFix()\nfix.latitude, fix.longitude = HOME", "8"),
    # functions and classes that are not called
    ("now = self.clock.now\nself.last = now\nnow - self.last", "self.clock.now"),
    ("self.battery = Battery", "Battery"),
    # the other part of a service
    ("request = SetBool.Response(success=True)\nawait self.clients.enable.call(request)",
     "SetBool.Response"),
    # values that may be None
    ("spot = self.route.current\nspot.moved(1.0)", "spot"),
    ("best = max(self.clusters, key=lambda c: c.size, default=None)\nbest.size", "best"),
    ("first = next((c for c in self.clusters), None)\nprint(first.x)", "first"),
    # classes that are known completely
    ("self.route.spots[0].z", "z"),
    ("Section(name='a', widht=1.0)", "widht"),
    ("Section(name='a', width=1.0).width", "width"),
    ("slices(3)", "slices"),
    ("worst = max(message.intensities)\nself.queue[0][1].w", "w"),
    # formats
    ("f'{1.0 / 3:d}'", "1.0 / 3"),
    ("f'{len(self.queue):.2d}'", "len(self.queue)"),
    # functions and modules
    ("math.distance(self.goal, self.goal)", "distance"),
    ("from std_msgs import Bool, Float32\nBool, Float32", "Bool"),
    ("from nav_msgs.msg import Point, Pose\nPoint, Pose", "Point"),
]  # fmt: skip
RIGHT = [
    "spot = self.route.current\nif spot is not None:\n    spot.moved(1.0).x",
    "best = max(self.clusters, key=lambda c: c.size, default=None)\nbest and best.size",
    "first = next((c for c in self.clusters), Cluster(1.0, 2))\nfirst.x",
    "Section(name='a', width=1.0)['width'], Section(name='a', width=1.0).get('name')",
    "slices(3, 1.0)",
    "f'{1.0:.2f} {len(self.queue):3d} {len(self.queue):.1f} {round(1.5):d} {1:e}'",
    "a, b, c = self.parameters.goal",
    "client = self.action_clients.left if self.queue else self.action_clients.right\n"
    "await client.send_goal(Navigate.Goal())",
    "x, y, z = self.goal\na, b, c = range(3)\nself.times.append(1.0)",
    "_, point = heapq.heappop(self.queue)\nPose(position=point)",
    "Battery(1.0), self.clusters[0].count(1.0), self.clusters[0].size * 2.0",
    "pose = Odometry()\npose.pose.covariance = np.zeros((6, 6)).ravel()",
    "pose.pose.covariance = np.eye(6).flatten().tolist()\npose.pose.covariance = [0.0] * 36",
    "Image(data=[255] * 4), ColorRGBA(r=1.0), Image(data=np.zeros(4).tolist())",
    "LaserScan(ranges=[0] * 3), LaserScan(ranges=[1, 2.5]), LaserScan().ranges.append(1)",
    "fix = NavSatFix()\nfix.latitude, fix.longitude = (1.0, 2.0)",
    "if self.kernel.any() or self.kernel.size or self.kernel[0] > 1.0:\n    pass",
    "if self.kernel is not None and (self.kernel > 0.5).all():\n    pass",
    "mask = (self.kernel > 0.1) & ~(self.kernel > 0.5)\nself.kernel[mask] = 0.0",
    "for value in self.kernel[self.kernel > 0.1]:\n    pass",
    "self.kernel.sum(axis=0, keepdims=True), self.kernel.std(ddof=1), self.kernel.max(initial=0)",
    "found = None\nfor value in self.kernel:\n    found = value if found is None else found",
    "low = 0\nlow = low + 0.5\nlow.is_integer()",
    "text = 'a'\ntext = text.encode()\ntext.decode()",
]


def _found(folder: Path, statement: str) -> list[Diagnostic]:
    code = CODE.replace("{statement}", statement.replace("\n", "\n        "))
    (folder / "code.py").write_text(code, encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)


@pytest.mark.parametrize(("statement", "text"), MISTAKES)
def test_a_mistake_is_reported_once(statement: str, text: str, tmp_path: Path) -> None:
    [diagnostic] = _found(tmp_path, statement)
    assert quoted(diagnostic) == text


def test_right_code_is_not_reported(tmp_path: Path) -> None:
    found = _found(tmp_path, "\n".join(RIGHT))
    assert [(item.message, quoted(item)) for item in found] == []
