"""Calls that all fail in the same way, because the function was changed and not they."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import replace

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import BehaviorSource, Function
from composer.behavior_source.syntax import name_span
from composer.behavior_source.traversal import walk

_SEVERAL = 2


def at_definitions(
    problems: Iterable[CodeProblem], source: BehaviorSource
) -> Iterator[CodeProblem]:
    """Yield the problems; one that all calls of a function have is reported at the function."""
    found = list(problems)
    alike: dict[tuple[int, str], list[CodeProblem]] = {}
    for problem in found:
        if problem.called is not None and problem.kind is Kind.CALL:
            alike.setdefault((id(problem.called[0]), problem.message), []).append(problem)
    moved = {
        key: len(group)
        for key, group in alike.items()
        if len(group) >= _SEVERAL and group[0].called is not None
        if len(group) == _count_of_calls(group[0].called[0], source)
    }
    for problem in found:
        key = (id(problem.called[0]), problem.message) if problem.called is not None else (0, "")
        if key not in moved:
            yield problem
        elif problem is alike[key][0] and problem.called is not None:
            function, home = problem.called
            message = f"{problem.message} in each of its {moved[key]} calls"
            yield replace(problem, message=message, span=name_span(function, "def", home.source))


def _count_of_calls(function: Function, source: BehaviorSource) -> int:
    """Return how often the files of the behavior use the name of a function."""
    return sum(
        (isinstance(node, ast.Attribute) and node.attr == function.name)
        or (isinstance(node, ast.Name) and node.id == function.name)
        for home in source.own_modules
        for node in walk(home.tree.body)
    )
