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
