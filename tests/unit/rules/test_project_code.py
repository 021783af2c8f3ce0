"""Code that uses the classes, functions and constants in other files of a project."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Diagnostic
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = "system: a\nnodes:\n  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}\n"
SHAPES = """\
import abc
from collections import namedtuple
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum, Flag

import numpy as np
from geometry_msgs.msg import Point

SIZES = {"small": 1.0, "large": 2.0}


Size = namedtuple("Size", "width, height", defaults=[1.0])


class Side(Enum):
    LEFT = 1
    RIGHT = 2

    @property
    def is_left(self):
        return self is Side.LEFT


class Light(Flag):
    RED = 1
    GREEN = 2


class ShapeError(ValueError):
    def __init__(self, shape, reason):
        super().__init__(reason)
        self.shape = shape


class Shape(abc.ABC):
    def __init__(self, name: str):
        self.name = name
        self.uses = 0

    def use(self):
        self.uses += 1
        return self.area()

    @abc.abstractmethod
    def area(self) -> float: ...


class Square(Shape):
    def __init__(self, name: str, size: float):
        super().__init__(name)
        self.size = size

    def area(self) -> float:
        return self.size * self.size

    def scaled(self, factor):
        return Square(self.name, self.size * factor)


@dataclass
class Place:
    x: float
    y: float = 0.0


@dataclass
class Named(Place):
    name: str = field(default="", kw_only=True)


class Plan:
    def __init__(self):
        self.shapes: dict[str, Shape] = {}
        self.counts = {"used": 0}

    def add(self, shape: Shape):
        self.shapes[shape.name] = shape
        self.counts["used"] += 1

    def middle(self):
        return Point(x=1.0)

    def values(self) -> np.ndarray:
        return np.zeros(3)


class Filter:
    def __init__(self, gain):
        self.gain = gain
        self.sides = [Side.LEFT]

    def __call__(self, value):
        return value * self.gain

    def __iter__(self):
        for side in Side.LEFT, Side.RIGHT:
            yield side

    def __enter__(self):
        return self

    def __exit__(self, *error):
        print(error)


@contextmanager
def lit(color):
    print(color)
    yield Side.LEFT


def nothing():
    print("nothing")
"""
PACKAGE = "from shapes.shapes import Plan, Side\n"
CODE = """\
import heapq
import random
from typing import TypedDict

import numpy as np
import shapes
from geometry_msgs.msg import Point, Pose
from shapes import Plan
from shapes import shapes as all_shapes
from collections import deque, namedtuple
from dataclasses import replace
from enum import Enum
from shapes.shapes import (
    SIZES, Filter, Light, Named, Place, Shape, ShapeError, Side, Size, Square, lit, nothing
)


GAINS = {"left": 1.0, "right": 2.0}
SIDES = ("left", "right", "top")


class Gear(Enum):
    LOW = 1
    HIGH = 2


GEARS = {Gear.LOW: "l"}


class Entry(TypedDict):
    name: str
    size: float


TABLE = np.array([1.0, 2.0, 3.0])


def turned():
    return np.linalg.pinv(np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]))


class Code:
    def on_configure(self):
        self.gear = Gear.LOW
        self.plan = Plan()
        self.square = Square("a", 1.0)

    def gain(self, side):
        return GAINS[side]

    def show(self):
        print(GEARS[self.gear])

    def safe_gain(self, side):
        return GAINS[side] if side != "top" else 0.0

    def on_tick(self):
        point, pose = Point(), Pose()
        try:
            {statement}
        except ShapeError as error:
            print(error.shape)
        except TypeError as error:
            print(error.args)
"""
RIGHT = [
    "self.plan.add(self.square.scaled(2.0))",
    "self.plan.add(shape=Square(size=1.0, name='b'))",
    "point.x = self.square.area() + self.plan.shapes['a'].use()",
    "print(Side['LEFT'], Side(1).is_left, Light.RED | Light.GREEN, all_shapes.Side.LEFT.name)",
    "print(Named(1.0, name='n').x, Place(x=1.0, y=2.0), shapes.Plan().counts['used'])",
    "self.plan.counts['new'] = 1; print(self.plan.counts['new'])",
    "print(SIZES.get('huge'), SIZES['small'], {**SIZES}['large'])",
    "pose.position = self.plan.middle()",
    "self.square.color = 'red'; print(self.square.color)",
    "point.x = float(self.plan.values().mean())",
    "print(np.fft.rfft(self.plan.values()), np.some_function_of_the_future)",
    "np.zeros((2, 3)), np.zeros(3, float), np.array([1.0], dtype=np.uint8), np.zeros(shape=3)",
    "np.interp(point.x, TABLE, 2 * TABLE), np.interp(point.x, [*TABLE], [1.0, 2.0])",
    "np.concatenate([TABLE, TABLE]), np.concatenate((TABLE, TABLE), 0), np.sqrt(2.0, where=True)",
    "turned() @ TABLE, turned() @ turned().T, np.eye(2) @ turned(), TABLE @ TABLE",
    "heapq.heappush([], point), heapq.nsmallest(1, [2]), random.choice('ab'), np.clip(1, 2, 3)",
    "self.gear = Gear.LOW; print(GEARS.get(Gear.HIGH))",
    "self.gear = Gear.HIGH\n            if self.gear in GEARS: self.show()",
    "self.gear = Gear.HIGH\n            if self.gear != Gear.HIGH: self.show()",
    "for side in SIDES[:2]: print(GAINS[side], GAINS.get('top'), self.safe_gain('top'))",
    "for side in ('left', 'right'): print(GAINS[side], self.gain(side))",
    "entry: Entry = {}; print(entry['name'].upper(), entry['size'] / 2, entry.get('nam'))",
    "entry: Entry = {}; entry['more'] = 1; print(entry['more'])",
    "raise ShapeError(self.square, 'too large')",
    "print(Size(1.0).height, Size(height=2, width=1)[0], Size(*'ab')._asdict())",
    "print(Size(1.0)._replace(height='a').height, Size._fields)",
    "print(Size(1, 2) * 2, Size(1, 2) + (3,), np.zeros(2) / Size(1, 2))",
    "self.square = self.square.scaled(2.0)",
    "print(replace(Named(1.0), x=2.0, name='b').name)",
    "print(Filter(2.0)(3.0), [side.name for side in Filter(gain=1)])",
    "with Filter(1) as filter, lit('red') as side: print(filter.gain, side.is_left)",
    "print(deque([1], maxlen=5).maxlen)",
]


@pytest.mark.parametrize(
    ("statement", "rule", "text"),
    [
        ("self.square.scale(2.0)", "unknown-attribute", "scale"),
        ("print(self.square.scaled(2.0).tint)", "unknown-attribute", "tint"),
        ("print(self.plan.shapes['a'].tint)", "unknown-attribute", "tint"),
        ("self.square.scaled()", "call-arguments", "self.square.scaled"),
        ("self.square.use(1)", "call-arguments", "1"),
        ("self.plan.add(Place(1.0))", "call-arguments", "Place(1.0)"),
        ("Square('a')", "call-arguments", "Square"),
        ("Square(1.0, 'a')", "call-arguments", "1.0"),
        ("Named(1.0, title='n')", "call-arguments", "title"),
        ("Named(1.0, 0.0, 'n')", "call-arguments", "'n'"),
        ("print(Side.TOP)", "unknown-attribute", "TOP"),
        ("print(Light.BLUE)", "unknown-attribute", "BLUE"),
        ("print(Side.LEFT.is_right)", "unknown-attribute", "is_right"),
        ("print(all_shapes.Sides)", "unknown-import", "Sides"),
        ("print(shapes.Plans)", "unknown-import", "Plans"),
        ("print(SIZES['smal'])", "invalid-value", "'smal'"),
        ("print(SIZES['small' if point.x else 'big'])", "invalid-value", "'big'"),
        ("raise ShapeError('too large')", "call-arguments", "ShapeError"),
        ("point.x = self.plan.middle()", "invalid-value", "self.plan.middle()"),
        ("pose.position = nothing()", "invalid-value", "nothing()"),
        ("pose.position = Side.LEFT", "invalid-value", "Side.LEFT"),
        ("point.x = self.plan.values()", "invalid-value", "self.plan.values()"),
        ("print(self.plan.values().average())", "unknown-attribute", "average"),
        ("Size()", "call-arguments", "Size"),
        ("Size(1, 2, 3)", "call-arguments", "3"),
        ("print(Size(1, 2).length)", "unknown-attribute", "length"),
        ("print(Size(1)._replace(length=2).width)", "call-arguments", "length"),
        ("print(Size(1, 2) / 2)", "invalid-value", "Size(1, 2) / 2"),
        ("namedtuple('Extent', 'a b', default=[1])", "call-arguments", "default"),
        ("self.square = self.square.scale(2.0)", "unknown-attribute", "scale"),
        ("replace(Place(1.0), z=2.0)", "call-arguments", "z"),
        ("replace(Place(1.0), x='a')", "call-arguments", "'a'"),
        ("Filter(2.0)(1.0, 2.0)", "call-arguments", "2.0"),
        ("print([side.left for side in Filter(1)])", "unknown-attribute", "left"),
        ("for side in Place(1.0): print(side)", "invalid-value", "Place(1.0)"),
        ("with lit() as side: print(side)", "call-arguments", "lit"),
        ("with lit('red') as side: print(side.left)", "unknown-attribute", "left"),
        ("with Filter(1) as filter: print(filter.gains)", "unknown-attribute", "gains"),
        ("deque([1], max=5)", "call-arguments", "max"),
        ("np.columnstack((point.x, point.y))", "unknown-import", "columnstack"),
        ("np.fft.rfftt([1.0])", "unknown-import", "rfftt"),
        ("np.interp(point.x, [1.0, 2.0])", "call-arguments", "np.interp"),
        ("np.interp(point.x, np.array([1.0, 2.0]), TABLE)", "call-arguments", "TABLE"),
        ("np.zeros(2, 3, dtype=bool)", "call-arguments", "dtype"),
        ("np.zeros(2, 3)", "call-arguments", "3"),
        ("np.zeros((point.x, 2))", "call-arguments", "(point.x, 2)"),
        ("np.linspace(0.0, 1.0, num=point.x / 2)", "call-arguments", "point.x / 2"),
        ("np.concatenate(TABLE, np.zeros(3))", "call-arguments", "np.zeros(3)"),
        ("np.vstack(TABLE, np.zeros(3), TABLE)", "call-arguments", "np.zeros(3)"),
        ("np.maximum(TABLE)", "call-arguments", "np.maximum"),
        ("np.eye(3) @ np.array([1.0, 2.0])", "invalid-value", "np.eye(3) @ np.array([1.0, 2.0])"),
        ("turned() @ [1.0, 2.0]", "invalid-value", "turned() @ [1.0, 2.0]"),
        ("self.gear = Gear.HIGH", "invalid-value", "self.gear"),
        ("print(GEARS[Gear.HIGH])", "invalid-value", "Gear.HIGH"),
        ("for side in SIDES: print(GAINS[side])", "invalid-value", "side"),
        ("print([GAINS[side] for side in SIDES])", "invalid-value", "side"),
        ("self.gain('top')", "invalid-value", "side"),
        ("[self.gain(side) for side in SIDES]", "invalid-value", "side"),
        ("entry: Entry = {}; print(entry['nam'])", "invalid-value", "'nam'"),
        ("entry: Entry = {}; print(entry['name'] / 2)", "invalid-value", "entry['name'] / 2"),
        ("heapq.heappush(point, [])", "call-arguments", "point"),
        ("heapq.heappush([1])", "call-arguments", "heapq.heappush"),
        ("random.choice(point.x)", "call-arguments", "point.x"),
    ],
)
def test_a_mistake_is_reported_once(statement: str, rule: str, text: str, tmp_path: Path) -> None:
    [diagnostic] = _found(tmp_path, statement)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


@pytest.mark.parametrize("statement", RIGHT)
def test_right_code_is_not_reported(statement: str, tmp_path: Path) -> None:
    assert _found(tmp_path, statement) == []


@pytest.mark.parametrize(
    ("old", "new", "rule", "text"),
    [
        ("return self.area()", "return self.aria()", "unknown-attribute", "aria"),
        ("super().__init__(name)", "super().__init__(name, size)", "call-arguments", "size"),
        ("super().__init__(name)", "super().__init__()", "call-arguments", "super().__init__"),
        ("self.size * self.size", "self.size * self.side", "unknown-attribute", "side"),
        ('self.counts["used"] += 1', 'self.counts["use"] += 1', "invalid-value", '"use"'),
        ("self.shape = shape", "self.form = shape", "unknown-attribute", "shape"),
        ('default=""', "default=[]", "invalid-value", "[]"),
        ('default=""', "default_factory=[]", "invalid-value", "[]"),
        ("default=", "defualt=", "call-arguments", "defualt"),
        ("np.zeros(3)", "np.zeroes(3)", "unknown-import", "zeroes"),
        ("self is Side.LEFT", "self is Side.LEFT)", "python-syntax", ")"),
    ],
)
def test_a_mistake_in_a_helper_is_reported_once(
    old: str, new: str, rule: str, text: str, tmp_path: Path
) -> None:
    helper = SHAPES.replace(old, new, 1)
    [diagnostic] = _found(tmp_path, "raise ShapeError(self.square.use(), 'wrong')", helper)
    assert (diagnostic.rule.name, quoted(diagnostic)) == (rule, text)


def test_a_changed_helper_is_read_again(tmp_path: Path) -> None:
    statement = "print(self.square.tint)"
    assert [item.rule.name for item in _found(tmp_path, statement)] == ["unknown-attribute"]
    with_attribute = SHAPES.replace("self.size = size", "self.size = self.tint = size")
    assert _found(tmp_path, statement, with_attribute) == []


@pytest.mark.parametrize(
    "helper",
    [
        # a mixin: what others derive from it has the attribute
        "class Mixin:\n    def show(self):\n        print(self.text)\n\n\n"
        "class Full(Mixin):\n    text = 'a'\n\n\nfull = Full()\n",
        # it passes itself to code that may set attributes
        "import argparse\n\n\nclass Options:\n    def __init__(self):\n"
        "        argparse.ArgumentParser().parse_args([], self)\n        print(self.speed)\n\n\n"
        "options = Options()\n",
        # derived classes may be created otherwise
        "class Base:\n    @classmethod\n    def make(cls):\n        return cls(1)\n\n\n"
        "class Full(Base):\n    def __init__(self, number):\n        self.number = number\n\n\n"
        "full = Full.make()\n",
        # a method that is not implemented may take other arguments in derived classes
        "class Base:\n    def run(self):\n        self.step(1)\n\n    def step(self):\n"
        "        raise NotImplementedError\n\n\nbase = Base()\n",
        # the elements of a list or dict may change
        "class Table:\n    def __init__(self):\n        self.rows = {'a': (1, 2)}\n\n"
        "    def add(self, name):\n        self.rows[name] = (1, 2, 3)\n"
        "        a, b, c = self.rows[name]\n        return a, b, c\n\n\ntable = Table()\n",
        # a name that is defined in several ways
        "import sys\n\nif sys.platform == 'linux':\n\n    class Port:\n"
        "        def __init__(self, path):\n            self.path = path\n\n"
        "else:\n\n    class Port:\n        pass\n\n\nport = Port('a')\n",
    ],
)
def test_classes_that_may_have_more_are_not_reported(helper: str, tmp_path: Path) -> None:
    (tmp_path / "more.py").write_text(helper, encoding="utf-8")
    assert _found(tmp_path, "import more; print(more)") == []


def _found(folder: Path, statement: str, helper: str = SHAPES) -> list[Diagnostic]:
    package = folder / "shapes"
    package.mkdir(exist_ok=True)
    (package / "__init__.py").write_text(PACKAGE, encoding="utf-8")
    (package / "shapes.py").write_text(helper, encoding="utf-8")
    (folder / "code.py").write_text(CODE.replace("{statement}", statement), encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)
