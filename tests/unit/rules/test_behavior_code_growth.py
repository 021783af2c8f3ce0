"""Checking the Python code of a behavior takes linear time."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in
from tests.unit.support.growth import assert_linear

SYSTEM = "system: a\nnodes:\n  n: {behavior: code:Code, timers: {tick: {period_ms: 100}}}\n"
METHOD = "class Code:\n    def on_tick(self):\n        pass\n"


@pytest.mark.slow
def test_many_functions_that_call_each_other(tmp_path: Path) -> None:
    def validate(count: int) -> None:
        lines = "".join(f"def f{number}(): return f0()\n" for number in range(count))
        folder = tmp_path / str(count)
        folder.mkdir(exist_ok=True)
        (folder / "code.py").write_text(lines + METHOD, encoding="utf-8")
        assert diagnostics_in(SYSTEM, folder) == []

    assert_linear(validate, 500, 5000)


LINES = {
    "set": "        self.a{0} = {0}\n        x = self.a{0}\n",
    "if": "        if self.a{0}: x{0} = {0}\n",
    "return": "        if self.a: return self.on_tick()\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_many_statements_of_one_method(tmp_path: Path, line: str) -> None:
    def validate(count: int) -> None:
        lines = "".join(line.format(number) for number in range(count))
        write(tmp_path, count, f"class Code:\n    def on_tick(self):\n{lines}")

    assert_linear(validate, 200, 2000)


@pytest.mark.slow
@pytest.mark.parametrize(("part", "between"), [("self.a", " and "), ("{self.a}", "")])
def test_long_expressions(tmp_path: Path, part: str, between: str) -> None:
    def validate(count: int) -> None:
        text = between.join(count * [part])
        value = f'f"{text}"' if not between else text
        write(tmp_path, count, f"class Code:\n    def on_tick(self):\n        x = {value}\n")

    assert_linear(validate, 500, 5000)


@pytest.mark.slow
def test_many_methods_that_call_each_other(tmp_path: Path) -> None:
    def validate(count: int) -> None:
        calls = ((number, (number + 1) % count) for number in range(count))
        lines = "".join(f"    def m{a}(self): return self.m{b}()\n" for a, b in calls)
        write(tmp_path, count, METHOD + lines)

    assert_linear(validate, 200, 2000)


def write(parent: Path, count: int, code: str) -> None:
    """Write the code into a folder of its own, and check it."""
    folder = parent / str(count)
    folder.mkdir(exist_ok=True)
    (folder / "code.py").write_text(code, encoding="utf-8")
    diagnostics_in(SYSTEM, folder)
