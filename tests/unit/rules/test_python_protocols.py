"""What Python itself asks of classes, conditions, 'with', 'await' and indices."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Diagnostic
from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = "system: a\nnodes:\n  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}\n"
CODE = """\
import abc
import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import contextmanager
from dataclasses import InitVar, dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import Iterator, NamedTuple

from geometry_msgs.msg import PoseWithCovariance
from std_msgs.msg import String

TUPLE = (1.0, 2.0)


class Shape(abc.ABC):
    @abc.abstractmethod
    def area(self) -> float: ...

    def is_large(self) -> bool:
        return self.area() > 1.0


class Square(Shape):
    def area(self) -> float:
        return 4.0

    def hook(self):
        return None

    @property
    def side(self) -> float:
        return 2.0


class Circle(Shape):
    def aera(self) -> float:
        return 3.1


@dataclass(frozen=True)
class Fixed:
    x: float
    y: float = 0.0


class Pair(NamedTuple):
    left: float
    right: float = 1.0


class Mode(Enum):
    FAST = "fast"


@dataclass
class Task:
    name: str
    mode: Mode = Mode.FAST

    @classmethod
    def parse(cls, text: str) -> "Task":
        return cls(text)

    def renamed(self):
        {inside}


class Joints:
    names = ("a", "b")

    def __init__(self):
        self.last: Task | None = None

    def keep(self, task: Task):
        {keep}


class Code:
    def on_configure(self):
        self.square = Square()
        self.done = False
        self.names = {"a": 1.0}
        self.joints = Joints()
        self.task = Task.parse("a")
        self.row = [0.0] * 6
        self.counts: Counter[str] = Counter()
        self.places = dict.fromkeys(Joints.names, 0.0)

    async def on_tick(self):
        {statement}

    async def rows(self) -> AsyncIterator[int]:
        yield 1

    def pair(self) -> list[float]:
        return [1.0, 2.0]

    def parts(self, tasks: list[Task]):
        {parts}

    async def wait(self) -> float:
        await self.clock.sleep(0.1)
        return 1.0

    def value(self) -> float:
        return 1.0

    def later(self):
        return self.wait()

    def steps(self) -> Iterator[int]:
        yield 1

    @contextmanager
    def locked(self) -> Iterator[int]:
        yield 1
{definition}
"""

#: The statement and the text that is underlined.
MISTAKES = [
    # methods that are not called
    ("if self.square.is_large:\n    pass", "self.square.is_large"),
    ("if not self.square.is_large and self.done:\n    pass", "self.square.is_large"),
    ("if self.done or self.value:\n    pass", "self.value"),
    ("[s for s in [Square()] if s.is_large]", "s.is_large"),
    ("any(s.is_large for s in [Square()])", "s.is_large"),
    ("self.name.isdigit and self.log.info('a')\nassert not self.name.isdigit",
     "self.name.isdigit"),
    # await
    ("await self.wait", "self.wait"),
    ("await self.value()", "self.value"),
    ("await self.log.info('a')", "self.log.info"),
    ("await asyncio.sleep(0.5)", "asyncio.sleep"),
    # with
    ("with self.steps():\n    pass", "self.steps()"),
    ("with self.locked:\n    pass", "self.locked"),
    ("with Square():\n    pass", "Square()"),
    # indices
    ("Fixed(1.0)['x']", "'x'"),
    ("self.names.values()[0]", "0"),
    ("TUPLE[0] = 1.0", "0"),
    ("self.name[0] = 'a'", "0"),
    ("pair = Pair(1.0)\npair[0] = 2.0", "0"),
    # what cannot be set or created
    ("fixed = Fixed(1.0)\nfixed.y = 2.0", "y"),
    ("pair = Pair(1.0)\npair.left += 2.0", "left"),
    ("self.square.side = 1.0", "side"),
    ("Circle()", "Circle"),
    ("Shape()", "Shape"),
    # iteration
    ("for row in self.rows():\n    pass", "self.rows()"),
    ("async for row in self.names:\n    pass", "self.names"),
    ("await self.rows()", "self.rows()"),
    ("self.steps()", "self.steps()"),
    ("for name, place in self.places:\n    pass", "self.places"),
    ("String(data=self.counts)", "self.counts"),
    ("self.counts.most_common(1).items()", "items"),
    # lengths
    ("PoseWithCovariance(covariance=self.pair()[:1])", "self.pair()[:1]"),
    ("PoseWithCovariance(covariance=self.row * 5)", "self.row * 5"),
    ("PoseWithCovariance(covariance=[float(x) for x in TUPLE])", "[float(x) for x in TUPLE]"),
    ("PoseWithCovariance(covariance=[0.0] * 35 + self.pair())", "[0.0] * 35 + self.pair()"),
    ("PoseWithCovariance(covariance=[*self.row, *TUPLE])", "[*self.row, *TUPLE]"),
    # equality
    ("if self.task.mode == 'fast':\n    pass", "self.task.mode == 'fast'"),
    # repetition
    ("[1] * 2.5", "[1] * 2.5"),
]  # fmt: skip
RIGHT = [
    "if self.square.hook:\n    self.square.hook()",
    "self.done = self.square.is_large or None",
    "if self.square.side and self.square.is_large():\n    pass",
    "await self.wait()\nawait self.later()",
    "await asyncio.sleep(0)\nawait asyncio.sleep(delay=0)",
    "with self.locked() as number:\n    number + 1",
    "for step in self.steps():\n    step + 1",
    "list(self.names.values())[0], Pair(1.0)[0], TUPLE[1], self.name[0], self.names['a']",
    "Pair(1.0)._replace(left=1.0), Fixed(1.0)",
    "Square().area()",
    "self.done * ['a'], 2 * ['a'], ['a'] * self.done, self.done * 'a', 3 * TUPLE",
    "a, b, c, d = TUPLE * 2",
    "async for row in self.rows():\n    row + 1",
    "for name, place in self.places.items():\n    place + 1.0",
    "dict(self.counts), sum(self.counts.values()), [k for k, v in self.counts.most_common()]",
    "PoseWithCovariance(covariance=[0.0] * 34 + self.pair())",
    "PoseWithCovariance(covariance=(self.row * 6)[:36])",
    "PoseWithCovariance(covariance=[x for x in range(40) if x])",
    "PoseWithCovariance(covariance=list(PoseWithCovariance().covariance))",
    "items = [0.0]\nitems.extend(self.pair())\nPoseWithCovariance(covariance=items)",
    "self.task.mode == Mode.FAST or self.task.mode.value == 'fast'",
    "import random\n(random.random() < 0.5) * [1.0]",
]
#: Definitions of classes, and the text that is underlined.
WRONG_CLASSES = [
    ("class A:\n    @property()\n    def b(self):\n        return 1", "property()"),
    ("@contextmanager()\ndef b():\n    yield 1", "contextmanager()"),
    ("@dataclass\nclass A:\n    a: int = 1\n    b: int", "int"),
    ("@dataclass\nclass A:\n    a = field(default=1)", "a"),
    ("class A(NamedTuple):\n    a: int = 1\n    b: int", "int"),
    ("@dataclass\nclass A:\n    a: int\n    def __post_init__(self, b):\n        pass",
     "__post_init__"),
    ("@dataclass\nclass A:\n    a: InitVar[int]\n    def __post_init__(self):\n        pass",
     "__post_init__"),
    ("def a() -> Iterator[tuple[int, int]]:\n    yield 1", "1"),
    ("def a() -> list[int]:\n    return (x for x in range(3))", "(x for x in range(3))"),
    ("class A:\n    __slots__ = ('a',)\n    def __init__(self):\n        self.a = self.b = 1\n"
     "A()", "self.b"),
]  # fmt: skip
RIGHT_CLASSES = [
    "def a() -> Iterator[tuple[int, int]]:\n    yield 1, 2",
    "def a() -> Iterator[int]:\n    return (x for x in range(3))",
    "class A:\n    @cached_property\n    def b(self):\n        return 1",
    "@dataclass()\nclass A:\n    a: int = field(init=False, default=1)\n    b: int\nA(1)",
    "@dataclass\nclass A:\n    a: int = 1\n    b: int = field(kw_only=True)\nA(b=1)",
    "@dataclass(kw_only=True)\nclass A:\n    a: int = 1\n    b: int\nA(b=1)",
    "@dataclass\nclass A:\n    a: InitVar[int]\n    def __post_init__(self, a, b=1):\n        pass",
    "class A:\n    __slots__ = ('a', '__dict__')\n    def __init__(self):\n        self.b = 1\nA()",
    "class A:\n    __slots__ = ()\n    def use(self):\n        self.b = 1\n"
    "class B(A):\n    __slots__ = ('b',)\nB().use()",
    "class A:\n    __slots__ = ('a',)\n    def __init__(self):\n        self.b = 1\n"
    "    @property\n    def b(self):\n        return 1\n    @b.setter\n"
    "    def b(self, value):\n        pass\nA()",
    "class A(Shape):\n    def use(self):\n        pass\nclass B(A):\n    area = Square.area\nB()",
    "class A(Shape):\n    pass\nclass B(Shape):\n    def area(self):\n        return 1.0\n"
    "class C(A, B):\n    pass\nC()",
]


PLACES = ("inside", "keep", "parts")


def _found(
    folder: Path, statement: str = "pass", definition: str = "", **places: str
) -> list[Diagnostic]:
    indented = statement.replace("\n", "\n        ")
    code = CODE.replace("{statement}", indented).replace("{definition}", definition)
    for place in PLACES:
        code = code.replace("{" + place + "}", places.get(place, "pass"))
    (folder / "code.py").write_text(code, encoding="utf-8")
    return diagnostics_in(SYSTEM, folder)


@pytest.mark.parametrize(("statement", "text"), MISTAKES)
def test_a_mistake_is_reported_once(statement: str, text: str, tmp_path: Path) -> None:
    [diagnostic] = _found(tmp_path, statement)
    assert quoted(diagnostic) == text


@pytest.mark.parametrize(("definition", "text"), WRONG_CLASSES)
def test_a_wrong_definition_is_reported(definition: str, text: str, tmp_path: Path) -> None:
    [diagnostic] = _found(tmp_path, definition=definition)
    assert quoted(diagnostic) == text


@pytest.mark.parametrize(
    ("place", "statement", "text"),
    [
        ("inside", "return replace(self, nam='b')", "nam"),
        ("keep", "self.last = task.name", "task.name"),
        ("parts", "tasks.remove(tasks[0].name)", "tasks[0].name"),
    ],
)
def test_a_mistake_is_reported_in_other_classes(
    place: str, statement: str, text: str, tmp_path: Path
) -> None:
    [diagnostic] = _found(tmp_path, **{place: statement})
    assert quoted(diagnostic) == text


def test_right_code_is_not_reported(tmp_path: Path) -> None:
    found = _found(
        tmp_path,
        "\n".join(RIGHT),
        inside="return replace(self, name='b')",
        keep="self.last = task",
        parts="tasks.remove(tasks[0])",
    )
    assert [(item.message, quoted(item)) for item in found] == []


@pytest.mark.parametrize("definition", RIGHT_CLASSES)
def test_a_right_definition_is_not_reported(definition: str, tmp_path: Path) -> None:
    assert [item.message for item in _found(tmp_path, definition=definition)] == []
