"""Which names of a Python file are defined nowhere."""

from __future__ import annotations

import ast

import pytest

from composer.behavior_source.library import is_standard, standard_names
from composer.behavior_source.undefined_names import undefined_names

UNDEFINED = {
    "a": ["a"],
    "a + a": ["a"],
    "def f(): return a": ["a"],
    "def f():\n    x = 1\ndef g(): return x": ["x"],
    "class A:\n    x = 1\n    def f(self): return x": ["x"],
    "[x for x in range(3)]\nx": ["x"],
    "def f(x=y): pass": ["y"],
    "class A(B): pass": ["B"],
    "@a\ndef f(): pass": ["a"],
    "(lambda x: y)(1)": ["y"],
    "x: int = y": ["y"],
    "def f(x: A, *y: B, z: C = 1) -> D: pass": ["A", "B", "C", "D"],
    "class A:\n    async def f(self, x: B): pass": ["B"],
    "class A:\n    x: B": ["B"],
    "x: A = 1": ["A"],
    "f'{a}'": ["a"],
    "del a": [],
}
DEFINED = [
    "import a.b\na",
    "import a.b as c\nc",
    "from a import b\nb",
    "def f(): return g()\ndef g(): return 1",
    "def f():\n    global a\n    a = 1\na",
    "def f():\n    x = 1\n    def g():\n        nonlocal x\n        return x",
    "class A:\n    x = 1\n    y = x",
    "from __future__ import annotations\ndef f(x: A) -> B: pass\ny: C = 1",
    "class A:\n    def f(self) -> 'B': pass",
    "def f():\n    x: Unknown = 1",
    "class A:\n    class B: pass\n    def f(self, x: B): pass",
    "def f(*a, b, **c): return a, b, c",
    "with f() as (a, b):\n    a\ndef f(): pass",
    "try:\n    pass\nexcept ValueError as e:\n    e",
    "match 1:\n    case {'a': x, **rest}:\n        x, rest\n    case [y, *z]:\n        y, z",
    "[y for x in [1] if (y := x)]\ny",
    "{x: y for x, y in []}",
    "[[x for x in y] for y in []]",
    "for i in range(3):\n    i",
    "__name__, __file__, print",
    "from a import *\nb",
    "exec('a = 1')\na",
    "def f():\n    class A: pass\n    return A",
    "def f(): return __class__",
]


@pytest.mark.parametrize(("text", "names"), UNDEFINED.items())
def test_undefined_names(text: str, names: list[str]) -> None:
    assert [name.id for name, _ in undefined_names(ast.parse(text))] == names


@pytest.mark.parametrize("text", DEFINED)
def test_defined_names(text: str) -> None:
    assert [name.id for name, _ in undefined_names(ast.parse(text))] == []


@pytest.mark.parametrize("module", ["math", "os.path", "statistics", "threading", "zlib"])
def test_the_names_of_standard_modules(module: str) -> None:
    assert is_standard(module)
    names = standard_names(module)
    assert names is not None
    imported = __import__(module, fromlist=["*"])
    assert {name for name in vars(imported) if name[0] != "_"} <= names


def test_standard_modules_that_do_not_exist() -> None:
    with pytest.raises(LookupError):
        standard_names("os.pth")
    assert not is_standard("numpy")
