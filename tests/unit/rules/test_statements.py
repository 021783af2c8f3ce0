"""Mistakes in the Python code of behaviors and of classes of rclpy, and code that is right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from textwrap import indent
from typing import TypeAlias

import pytest

from composer.base.diagnostics import has_errors
from tests.unit.support.checking import quoted
from tests.unit.support.statements import FOLDER, Statements, diagnostics_of

NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
BEHAVIOR = Statements.read("behavior")

#: A statement, the rule that it breaks, and the text that is underlined.
Mistake: TypeAlias = tuple[str, str, str]
#: Mistakes with their places.
Group: TypeAlias = list[tuple[str, Mistake]]


def is_checked(statement: str) -> bool:
    """Return whether the statement needs no numpy, or numpy is installed."""
    return "self.filter." not in statement or find_spec("numpy") is not None


def in_groups(mistakes: Mapping[str, Sequence[Mistake]], size: int) -> list[Group]:
    """Return the mistakes in groups of up to ``size`` in each place."""
    groups: dict[int, Group] = {}
    for place, each in mistakes.items():
        checked = [mistake for mistake in each if is_checked(mistake[0])]
        for number, mistake in enumerate(checked):
            groups.setdefault(number // size, []).append((place, mistake))
    return list(groups.values())


def code_of(statements: Statements, group: Group) -> str:
    """Return the code with all mistakes of the group, under conditions if there are several."""
    if len(group) == 1:
        [(place, (text, _, _))] = group
        return statements.code_with(place, text)
    lines: dict[str, list[str]] = {}
    for number, (place, (text, _, _)) in enumerate(group):
        lines.setdefault(place, []).append(f"if id(0) > {number}:\n{indent(text, '    ')}")
    return statements.code_with_each({place: "\n".join(each) for place, each in lines.items()})


def differences(name: str, groups: Sequence[Group], folder: Path) -> list[tuple[Group, object]]:
    """Return the groups whose mistakes are not reported once each, and what is reported."""
    statements = Statements.read(name)
    codes = [code_of(statements, group) for group in groups]
    results = diagnostics_of(statements.system, codes, folder)
    if name == "class":  # written before there was the composer
        assert not any(map(has_errors, results))
    reported = [sorted((item.rule.name, quoted(item)) for item in found) for found in results]
    return [
        (group, found)
        for group, found in zip(groups, reported, strict=True)
        if found != sorted((rule, marked) for _, (_, rule, marked) in group)
    ]


@pytest.mark.parametrize("name", NAMES)
def test_each_mistake_is_reported_once_where_it_is(name: str, tmp_path: Path) -> None:
    """Four at a time; one at a time where they have an effect on each other."""
    groups = in_groups(Statements.read(name).mistakes, 4)
    different = differences(name, groups, tmp_path / "groups")
    single = [[mistake] for group, _ in different for mistake in group]
    assert differences(name, single, tmp_path / "single") == []


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
