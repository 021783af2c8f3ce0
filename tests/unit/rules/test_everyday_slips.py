"""Slips that Python itself does not refuse before the line runs, and code that is right."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from tests.unit.support.checking import quoted
from tests.unit.support.python_cases import diagnostics_of

SYSTEM = "system: a\nnodes:\n  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}\n"
CODE = """\
import logging
from dataclasses import asdict, dataclass
from enum import Enum

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from sensor_msgs.msg import CameraInfo, Image, Imu, LaserScan
from std_msgs.msg import Bool, String


logger = logging.getLogger(__name__)


class Mode(Enum):
    FAST = "fast"


@dataclass
class Task:
    name: str

    def label(self) -> str:
        return self.name


class Filter:
    def __init__(self):
        self.covariance = np.diag([1.0, 1.0, 1.0])
        self.state = np.zeros(9)

    def predict(self, change):
        self.covariance = change @ self.covariance @ change.T


class Code:
    def on_configure(self):
        self.filter = Filter()
        self.tasks: list[Task] = []
        self.by_name: dict[str, Task] = {}
        self.mode = Mode.FAST
        self.count = 0
        self.row = [1.0, 2.0]
        self.point = Point()
        self.scan = LaserScan()

    def on_tick(self):
        {statement}

    def pixels(self) -> np.ndarray:
        pixels = np.zeros((self.count, self.count, 3), dtype=np.uint8)
        pixels[0:2, 0] = 5
        return pixels

    def value(self) -> float:
        return 1.0
"""
#: The statement and the text that is underlined.
MISTAKES = [
    ("self.clock.now - 1.0", "self.clock.now - 1.0"),
    ("if self.clock.now > 1.0:\n    pass", "self.clock.now > 1.0"),
    ("for name, task in self.by_name.items:\n    pass", "self.by_name.items"),
    ("len(self.by_name.values)", "self.by_name.values"),
    ("-self.value", "-self.value"),
    ("self.value[0]", "self.value[0]"),
    ("String(data=self.name.upper)", "self.name.upper"),
    ("self.row['a']", "self.row['a']"),
    ("self.scan.ranges['a']", "self.scan.ranges['a']"),
    ("self.row[self.name]", "self.row[self.name]"),
    ("self.tasks.pop('a')", "'a'"),
    ("Mode['FASTT']", "'FASTT'"),
    ("Mode[self.count]", "self.count"),
    ("asdict(self.point)", "self.point"),
    ("asdict(self.mode)", "self.mode"),
    ("self.scan.header.stamp.sec += 0.5", "self.scan.header.stamp.sec"),
    ("self.scan.header.stamp.sec /= 2", "self.scan.header.stamp.sec"),
    ("print(Time(sec=self.value(), nanosec=self.value()))", "self.value()"),
    ("for task in self.tasks.sort():\n    pass", "self.tasks.sort()"),
    ("self.row.sort()[0]", "self.row.sort()[0]"),
    ("self.scan.ranges / 2.0", "self.scan.ranges / 2.0"),
    ("1 - self.scan.ranges", "1 - self.scan.ranges"),
    (
        "Imu().orientation_covariance = self.filter.covariance.tolist()",
        "self.filter.covariance.tolist()",
    ),
    ("float(self.point)", "self.point"),
    ("int(self.row)", "self.row"),
    ("abs(self.name)", "self.name"),
    ("next(self.row)", "self.row"),
    ("isinstance(self.point, [int, float])", "[int, float]"),
    ("isinstance(self.point, 'Point')", "'Point'"),
    ("self.name.startswith(5)", "5"),
    ("self.name.replace('a', 5)", "('a', 5)"),
    ("if self.count in 5:\n    pass", "self.count in 5"),
    ("if 'x' in self.point:\n    pass", "'x' in self.point"),
    ("if self.count in self.name:\n    pass", "self.count"),
    ("if 'a' in Task('a'):\n    pass", "'a' in Task('a')"),
    ("self.tasks.extend(['a'])", "['a']"),
    ("self.tasks += Task('a')", "self.tasks += Task('a')"),
    ("print(f'{Bool().data:s} {self.name:s}')", "{Bool().data:s}"),
]
RIGHT = [
    "self.clock.now() - 1.0, self.name.upper() + 'a'",
    "for name, task in self.by_name.items():\n    task.label()",
    "Imu().orientation_covariance = self.filter.covariance.ravel().tolist()",
    "Imu().orientation_covariance = self.filter.state.tolist()",
    "Bool(data=bool(np.any(self.pixels()))), Bool(data=not np.any(self.row))",
    "Bool(data=np.any is None), Bool(data=any(self.row)), Bool(data=max(self.row) > 1.0)",
    "self.row[0], self.row[-1:], self.row[True], self.scan.ranges[0], self.name[0]",
    "Mode['FAST'], Mode('fast'), Mode.__members__['FAST']",
    "self.row.sort()\nself.tasks.append(Task('a'))\nself.tasks.pop(0)",
    "later = self.row.append\nlater(2.0)",
    "float(self.name), int(self.row[0]), abs(self.value()), round(1.5, 1), float(b'1')",
    "next(iter(self.row)), next(x for x in self.row), next(enumerate(self.row))",
    "isinstance(self.point, (int, float)), isinstance(self.count, int | float)",
    "self.name.startswith(('a', 'b')), self.name.split(None), self.name.replace('a', 'b', 1)",
    "values = {None}\nvalue = values.pop()\nfor line in iter(self.value, 0.0):\n    line + 1",
    "Image(data=self.pixels().tobytes()), Image(data=self.pixels().ravel())",
    "self.scan.ranges * 2, CameraInfo().k / 2.0, np.array(self.scan.ranges) / 2.0",
    "LaserScan(ranges=np.zeros(3)), LaserScan(ranges=np.zeros((3,)))",
    "{(1, 2): 3}, {'a', 'b'}, {Mode.FAST: 1}, {Task: 1}",
    "self.mode in (Mode.FAST, None), 'a' in self.name, 1 in self.row, 'a' in self.by_name",
    "self.mode.value in ('fast', 'slow'), self.count in range(5), self.mode in Mode",
    "self.tasks.extend([Task('a')])\nself.tasks += [Task('b')]\nself.row.extend(range(3))",
    "self.label = self.name or 'b'\nself.other = self.name == 'a' or 'b'",
    "if self.name == 'a' or self.name == 'b' or self.count is None:\n    pass",
    "asdict(Task('a'))\nself.scan.header.stamp.sec += 2\nself.scan.header.stamp.sec //= 2",
    "self.scan.range_max += 1\nself.count += 0.5",
    "logger.info('%s of %s', self.name, self.count), logger.info('100 %'), logging.info('%s', {})",
    "logger.info('%(a)s', {'a': 1}), f'{self.name:s} {self.mode!s:s} {self.value():5}'",
    "self.kind = Bool\nself.kind = String",
    "[].append(1), [1, 'a'].index('a'), 'a' in [1, 'a']",
]


def _code(statement: str) -> str:
    return CODE.replace("{statement}", statement.replace("\n", "\n        "))


def test_a_slip_is_reported_once(tmp_path: Path) -> None:
    # What an array of numpy returns is known only where numpy is installed.
    has_numpy = find_spec("numpy") is not None
    mistakes = [case for case in MISTAKES if has_numpy or "covariance" not in case[0]]
    results = diagnostics_of(SYSTEM, [_code(statement) for statement, _ in mistakes], tmp_path)
    reported = [
        (statement, *map(quoted, found))
        for (statement, _), found in zip(mistakes, results, strict=True)
    ]
    assert reported == mistakes


def test_right_code_is_not_reported(tmp_path: Path) -> None:
    [found] = diagnostics_of(SYSTEM, [_code("\n".join(RIGHT))], tmp_path)
    assert [(item.message, quoted(item)) for item in found] == []
