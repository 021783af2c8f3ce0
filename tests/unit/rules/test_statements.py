"""Mistakes in the Python code of behaviors and of classes of rclpy, and code that is right."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from composer.base.diagnostics import has_errors
from tests.unit.support.checking import quoted
from tests.unit.support.statements import FOLDER, Statements, diagnostics_of

NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
BEHAVIOR = Statements.read("behavior")


def is_checked(statement: str) -> bool:
    """Return whether the statement needs no numpy, or numpy is installed."""
    return "self.filter." not in statement or find_spec("numpy") is not None


@pytest.mark.parametrize("name", NAMES)
def test_each_mistake_is_reported_once_where_it_is(name: str, tmp_path: Path) -> None:
    statements = Statements.read(name)
    cases = [
        (place, *case)
        for place, each in statements.mistakes.items()
        for case in each
        if is_checked(case[0])
    ]
    codes = [statements.code_with(*case[:2]) for case in cases]
    results = diagnostics_of(statements.system, codes, tmp_path)
    reported = [
        (*case[:2], *((item.rule.name, quoted(item)) for item in found))
        for case, found in zip(cases, results, strict=True)
    ]
    assert reported == [(place, text, (rule, marked)) for place, text, rule, marked in cases]
    if name == "class":  # written before there was the composer
        assert not any(map(has_errors, results))


@pytest.mark.parametrize("name", NAMES)
def test_right_code_is_not_reported(name: str, tmp_path: Path) -> None:
    statements = Statements.read(name)
    cases = [
        {place: each[number] for place, each in statements.right.items() if number < len(each)}
        for number in range(max(map(len, statements.right.values())))
    ]
    results = diagnostics_of(
        statements.system, [statements.code_with_each(case) for case in cases], tmp_path
    )
    reported = [
        (case, [item.message for item in found])
        for case, found in zip(cases, results, strict=True)
        if found
    ]
    assert reported == []


@pytest.mark.parametrize("annotation", ["", " -> None"])
def test_a_service_without_a_response(annotation: str, tmp_path: Path) -> None:
    right = BEHAVIOR.code_with().replace("response):", f"response){annotation}:")
    wrong = right.replace("return response", "pass")
    [correct, [found]] = diagnostics_of(BEHAVIOR.system, [right, wrong], tmp_path)
    assert correct == []
    assert (found.rule.name, quoted(found)) == ("missing-return", "on_reset")


def test_a_comment_in_python_ignores_a_warning(tmp_path: Path) -> None:
    code = BEHAVIOR.code_with("drive", "time.sleep(1.0)  # compose: ignore[blocking-call]")
    assert diagnostics_of(BEHAVIOR.system, [code], tmp_path) == [[]]
