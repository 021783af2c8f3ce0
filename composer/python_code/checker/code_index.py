"""The syntax of one file, by what a finding in a line needs to know."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import TypeVar

from composer.base.source import Span
from composer.python_code.syntax import Module
from composer.python_code.trees import (
    Function,
    catches,
    dotted,
    positional_arguments,
    span_of,
    walk,
)

_Statement = TypeVar("_Statement", bound=ast.stmt)
#: What code raises that uses a value of a wrong type.
_ERRORS = frozenset({"AttributeError", "NameError", "TypeError"})


class CodeIndex:
    """The parts of a file: assignments, functions, classes and names. The file is walked once."""

    def __init__(self, module: Module) -> None:
        self.module = module
        self._nodes = tuple(ast.walk(module.tree))
        self._expressions = [node for node in self._nodes if isinstance(node, ast.expr)]
        self._calls = [node for node in self._expressions if isinstance(node, ast.Call)]
        self.classes = [node for node in self._nodes if isinstance(node, ast.ClassDef)]
        self.functions = [node for node in self._nodes if isinstance(node, Function)]

    @cached_property
    def assignments(self) -> list[tuple[ast.expr, ast.stmt, ast.expr | None]]:
        """The targets of assignments, with the statement and the value."""
        found: list[tuple[ast.expr, ast.stmt, ast.expr | None]] = []
        for node in self._nodes:
            match node:
                case ast.Assign(targets=targets, value=value):
                    for target in targets:
                        found += [(x, node, value) for x in getattr(target, "elts", (target,))]
                case ast.AnnAssign(target=target) | ast.AugAssign(target=target):
                    found.append((target, node, node.value))
        return found

    @cached_property
    def names(self) -> frozenset[str]:
        """The names in the code, without those in texts."""
        names = {node.id for node in self._expressions if isinstance(node, ast.Name)}
        return frozenset(names | {x.arg for item in self.functions for x in arguments_of(item)})

    @cached_property
    def alternatives(self) -> frozenset[str]:
        """Names that several imports or classes bind, of which a condition may select one."""
        names = [node.name for node in self.classes]
        return frozenset({*self.module.alternatives, *(x for x in names if names.count(x) > 1)})

    @cached_property
    def passed_on(self) -> frozenset[str]:
        """Names that calls pass."""
        positional = (value for call in self._calls for value in call.args)
        by_name = (keyword.value for call in self._calls for keyword in call.keywords)
        return frozenset(map(dotted, (*positional, *by_name)))

    @cached_property
    def tested(self) -> frozenset[str]:
        """Names of which ``hasattr`` asks for an attribute."""
        tests = (call for call in self._calls if dotted(call.func) == "hasattr" and call.args)
        return frozenset(dotted(call.args[0]) for call in tests)

    def import_at(self, line: int) -> ast.Import | ast.ImportFrom | None:
        """Return the import in a line; None in a ``try`` or the like, where it may fail."""
        always = walk(self.module.tree.body, closed=(ast.If, ast.Match, ast.Try, ast.With))
        imports = (node for node in always if isinstance(node, ast.Import | ast.ImportFrom))
        return next((node for node in imports if _holds(node, line)), None)

    def expression_at(self, span: Span) -> ast.expr | None:
        """Return the outermost expression at a place."""
        nodes = (node for node in self._expressions if node.lineno == span.line)
        return next((node for node in nodes if span_of(node, span.file) == span), None)

    def names_in(self, line: int) -> set[str]:
        """Return the dotted names that a line uses."""
        return {dotted(node) for node in self._expressions if node.lineno == line} - {""}

    def is_guarded(self, line: int) -> bool:
        """Return whether a line is in a ``try`` that catches what a wrong type raises."""
        tries = (node for node in self._nodes if isinstance(node, ast.Try))
        guards = (x for x in tries if any(catches(handler, _ERRORS) for handler in x.handlers))
        return any(_holds(statement, line) for guard in guards for statement in guard.body)

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function that contains a line."""
        return _innermost(self.functions, line)

    def class_at(self, line: int) -> ast.ClassDef | None:
        """Return the innermost class that contains a line."""
        return _innermost(self.classes, line)

    def assigned_at(self, line: int) -> list[tuple[ast.expr, ast.stmt]]:
        """Return the targets that a line assigns, with the statements."""
        return [(target, node) for target, node, _ in self.assignments if _holds(node, line)]

    def values_of(self, name: str, line: int) -> list[ast.expr]:
        """Return the values of a local name or own attribute that a line may see."""
        scope = self.class_at(line) if "." in name else self.function_at(line)
        assigned = (item for item in self.assignments if dotted(item[0]) == name)
        around = (item for item in assigned if scope is None or _holds(scope, item[1].lineno))
        return [value for _, _, value in around if value is not None]

    def attributes_set(self) -> Iterator[str]:
        """Yield the methods and attributes that the code defines, of any object."""
        for target, node, _ in self.assignments:
            if not isinstance(node, ast.AugAssign):  # which reads the attribute first
                items = ast.walk(target)
                yield from (item.attr for item in items if isinstance(item, ast.Attribute))
        for item in (statement for class_ in self.classes for statement in class_.body):
            if isinstance(item, Function | ast.ClassDef):
                yield item.name
            elif isinstance(item, ast.Assign | ast.AnnAssign):
                yield from (node.id for node in ast.walk(item) if isinstance(node, ast.Name))

    @property
    def sets_computed_names(self) -> bool:
        """Whether the file sets attributes by name, so that any may exist."""
        return bool({"setattr", "vars"} & self.names) or "__dict__" in self.module.source.text


def arguments_of(function: Function) -> list[ast.arg]:
    """Return the arguments of a function that have a name."""
    return [*positional_arguments(function), *function.args.kwonlyargs]


def _innermost(nodes: Iterable[_Statement], line: int) -> _Statement | None:
    around = (node for node in nodes if _holds(node, line))
    return max(around, key=lambda node: node.lineno, default=None)


def _holds(node: ast.stmt, line: int) -> bool:
    return node.lineno <= line <= (node.end_lineno or node.lineno)
