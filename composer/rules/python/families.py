"""Turns the problems found in Python files into diagnostics: each family has its rule."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal, TypeAlias

from composer.analysis.context import Context
from composer.analysis.python_nodes import distinct_behaviors, distinct_classes
from composer.diagnostics import Diagnostic, Label, Rule, Severity
from composer.model import Node
from composer.python_code.checks import code_problems
from composer.python_code.checks.imports import import_problems
from composer.python_code.lookup import BehaviorSource
from composer.python_code.problems import Family, Problem
from composer.python_code.syntax import Module
from composer.python_code.trees import start_span, walk
from composer.rules.behaviors import blocking, handlers
from composer.rules.expressions import INDEX_OUT_OF_RANGE
from composer.rules.fields import INVALID_VALUE, UNKNOWN_FIELD
from composer.rules.python import plain_python, uses_of_nodes
from composer.rules.python.definitions import as_warning
from composer.rules.transforms import FRAME_ID_SLASH
from composer.source import Span

#: What a Python file is for: a behavior, or an rclpy class.
What: TypeAlias = Literal["behavior", "class"]

RULE_OF: Mapping[Family, Rule] = {
    Family.PORT: uses_of_nodes.UNKNOWN_ATTRIBUTE,
    Family.FIELD: UNKNOWN_FIELD,
    Family.VALUE: INVALID_VALUE,
    Family.INDEX: INDEX_OUT_OF_RANGE,
    Family.MESSAGE_TYPE: uses_of_nodes.WRONG_MESSAGE_TYPE,
    Family.AWAIT: uses_of_nodes.MISSING_AWAIT,
    Family.NAME: plain_python.UNDEFINED_NAME,
    Family.IMPORT: plain_python.UNKNOWN_IMPORT,
    Family.NOT_INSTALLED: plain_python.MODULE_NOT_INSTALLED,
    Family.INTERNAL: plain_python.INTERNAL_IMPORT,
    Family.ATTRIBUTE: plain_python.MISSING_ATTRIBUTE,
    Family.ARGUMENTS: plain_python.CALL_ARGUMENTS,
    Family.TYPE: plain_python.TYPE_ERROR,
    Family.RETURN: uses_of_nodes.MISSING_RETURN,
    Family.NONE: uses_of_nodes.UNCHECKED_NONE,
    Family.ANNOTATION: uses_of_nodes.HANDLER_ANNOTATION,
    Family.UNUSED: plain_python.UNUSED_RESULT,
    Family.ASYNCIO: uses_of_nodes.ASYNCIO_CALL,
    Family.BLOCKING: blocking.BLOCKING_CALL,
    Family.EARLY: uses_of_nodes.TOO_EARLY,
    Family.FRAME: FRAME_ID_SLASH,
    Family.SELF: plain_python.MISSING_SELF,
    Family.SIGNATURE: handlers.HANDLER_SIGNATURE,
    Family.PARAMETER: uses_of_nodes.UNDECLARED_PARAMETER,
    Family.CONSTRUCTOR: uses_of_nodes.MISSING_CONSTRUCTOR,
    Family.SYNTAX: plain_python.PYTHON_SYNTAX,
    Family.NOT_CHECKED: plain_python.NOT_CHECKED,
}


def diagnostic(problem: Problem, place: Span, what: What) -> Diagnostic:
    """Return the diagnostic of a problem; ``place`` is where the YAML file names the code.

    In a class nothing but its syntax is an error: it may run as it does today.
    """
    rule = RULE_OF[problem.family]
    is_error = (what == "behavior" and problem.is_certain) or problem.family is Family.SYNTAX
    if rule.severity is Severity.ERROR and not is_error:
        rule = as_warning(rule)
    label = Label(place, f"the {what} of this node")
    return Diagnostic(rule, problem.message, problem.span, (label,), problem.hint)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the problems of the files of behaviors and classes, each once."""
    for source, what, problem in _import_problems(context):
        yield diagnostic(problem, source.reference.text.span, what)
    for node, source, what in sources(context):
        for problem in code_problems(node, source, context.interfaces):
            yield diagnostic(problem, source.reference.text.span, what)


def sources(context: Context) -> Iterator[tuple[Node, BehaviorSource, What]]:
    """Yield the behaviors and classes of a system, each once for each way to use it."""
    for node, source in distinct_behaviors(context):
        yield node, source, "behavior"
    for item in distinct_classes(context):
        yield item.node, item.source, "class"


def _import_problems(context: Context) -> Iterator[tuple[BehaviorSource, What, Problem]]:
    """Yield the problems of the imports in all files."""
    checked: set[Path] = set()
    for _, source, what in sources(context):
        for module in source.own_modules:
            if module.path not in checked:
                checked.add(module.path)
                folder = source.reference.folder
                for problem in import_problems(module, folder, context.interfaces):
                    yield source, what, problem
                for problem in _alternatives(module, context):
                    yield source, what, problem


def _alternatives(module: Module, context: Context) -> Iterator[Problem]:
    """Yield the messages and other interfaces that a condition chooses at run time."""
    packages = context.interfaces.packages()
    chosen = {
        name
        for name, origins in module.alternatives.items()
        if any(origin.module.partition(".")[0] in packages for origin in origins)
    }
    for node in walk(module.tree.body) if chosen else ():
        if isinstance(node, ast.alias) and (node.asname or node.name) in chosen:
            chosen.remove(node.asname or node.name)
            message = f"'{node.asname or node.name}' is imported from several modules, so its uses"
            span = start_span(node, len(node.name), module.source)
            yield Problem(Family.NOT_CHECKED, f"{message} are not checked", span)
