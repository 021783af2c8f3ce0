"""The problems in the Python files of behaviors and classes: types, imports, undefined names."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from composer.analysis.context import Context
from composer.analysis.python.behaviors import GENERAL_HANDLERS, distinct_behaviors, handlers
from composer.analysis.python.hosted_classes import hosted_classes
from composer.behavior_checks import CodeProblem, Kind, behavior_problems, import_problems
from composer.behavior_source import BehaviorSource, Function, Module
from composer.behavior_source.receivers import lacks_self
from composer.behavior_source.spans import span_of
from composer.behavior_source.undefined_names import undefined_names
from composer.behavior_types.libraries.handlers import TRANSITIONS
from composer.diagnostics import Diagnostic, Label, Rule, nearest
from composer.model import Node


def diagnostics_of(context: Context, kind: Kind, rule: Rule) -> Iterator[Diagnostic]:
    """Yield the problems of one kind as diagnostics of ``rule``."""
    for source, problem in context.once(_problems):
        if problem.kind is kind:
            classes = {id(item.source) for item in context.once(hosted_classes)}
            what = "class" if id(source) in classes else "behavior"
            label = Label(source.reference.text.span, f"the {what} of this node")
            if problem.cause is not None:
                label = Label(problem.span, f"what the {what} expects")
                yield Diagnostic(rule, problem.message, problem.cause, (label,), problem.hint)
                continue
            yield Diagnostic(rule, problem.message, problem.span, (label,), problem.hint)


def _problems(context: Context) -> tuple[tuple[BehaviorSource, CodeProblem], ...]:
    """Return the problems of all behaviors and classes; those of a file are found once."""
    checked: set[Path] = set()
    found: list[tuple[BehaviorSource, CodeProblem]] = []
    unnamed: list[tuple[str, range]] = []  # where names are missing because of another problem
    for node, source in (*context.once(distinct_behaviors), *_distinct_classes(context)):
        for module in source.own_modules:
            if module.path not in checked:
                checked.add(module.path)
                found += ((source, problem) for problem in _of_file(context, node, source, module))
        for problem in behavior_problems(node, source, context.interfaces):
            if _lacks_parameter(problem, found):
                continue
            found.append((source, problem))
            if problem.lines is not None:
                first, last = problem.lines
                unnamed.append((problem.span.file.path, range(first, last + 1)))
    return tuple(item for item in found if not _follows(item[1], unnamed))


def _lacks_parameter(problem: CodeProblem, found: list[tuple[BehaviorSource, CodeProblem]]) -> bool:
    """Return whether a call passes more than a function takes that uses a name that it lacks."""
    if problem.called is None:
        return False
    function, home = problem.called
    lines = range(function.lineno, (function.end_lineno or function.lineno) + 1)
    return any(
        other.kind is Kind.NAME and other.span.file is home.source and other.span.line in lines
        for _, other in found
    )


def _follows(problem: CodeProblem, unnamed: list[tuple[str, range]]) -> bool:
    """Return whether a name is missing because of another problem."""
    span = problem.span
    return problem.kind is Kind.NAME and any(
        span.file.path == path and span.line in lines for path, lines in unnamed
    )


def _distinct_classes(context: Context) -> Iterator[tuple[Node, BehaviorSource]]:
    """Yield one node for each class of rclpy that a node is of."""
    seen: set[int] = set()
    for found in context.once(hosted_classes):
        if id(found.source) not in seen:
            seen.add(id(found.source))
            yield found.node, found.source


def _of_file(
    context: Context, node: Node, source: BehaviorSource, module: Module
) -> list[CodeProblem]:
    try:
        imports = list(import_problems(module, source.reference.folder, context.interfaces))
        # The name that a misspelled import was meant to define is not reported again.
        meant = {name for _, names in imports for name in names}
        if any(_lacking_self(module)):
            meant.add("self")
        meant.update(_missing_arguments(node, source))
        undefined = [
            CodeProblem(
                Kind.NAME,
                f"name '{name.id}' is not defined",
                span_of(name, module.source),
                _hint(name.id, known),
            )
            for name, known in _undefined_names(module)
            if name.id not in meant
        ]
    except RecursionError:  # too deeply nested to be checked
        return []
    return [*(problem for problem, _ in imports), *undefined]


@lru_cache(maxsize=128)
def _undefined_names(module: Module) -> tuple[tuple[ast.Name, frozenset[str]], ...]:
    return tuple(undefined_names(module.tree))


def _hint(name: str, known: frozenset[str]) -> str:
    if name in sys.stdlib_module_names:
        return f"add 'import {name}'"
    # Short names are alike too easily; most typos leave the first letter unchanged.
    close = nearest(name, (other for other in known if other[:1].lower() == name[:1].lower()))
    return f"did you mean '{close}'?" if close is not None else "import it, or define it"


def _missing_arguments(node: Node, source: BehaviorSource) -> Iterator[str]:
    """Yield the arguments of handlers that do not accept them; another rule reports these."""
    if node.hosted_class is not None:
        yield from (name.value for name, _ in node.hosted_class.arguments)
        transitions = (source.method(name) for name in TRANSITIONS)
        if any(method is not None and not method.accepts(1) for method in transitions):
            yield "state"
    for handler in handlers(node):
        method = source.method(handler.name)
        if method is not None and not method.accepts(len(handler.arguments)):
            yield from handler.arguments
    for name, arguments in GENERAL_HANDLERS.items():
        method = source.method(name)
        if method is not None and not method.accepts(len(arguments)):
            yield from arguments


def _lacking_self(module: Module) -> Iterator[Function]:
    for known in module.classes.values():
        for method in known.methods:
            if method.node is not None and lacks_self(method.node):
                yield method.node
