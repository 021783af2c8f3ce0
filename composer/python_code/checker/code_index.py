"""The syntax of one file, by what a finding in a line needs to know. Each file is walked once."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator

from composer.python_code.syntax import Module
from composer.python_code.trees import Function, catches, dotted, positional_arguments, span_of
from composer.source import Span

#: What code raises that uses a value of a wrong type.
_ERRORS = frozenset({"AttributeError", "NameError", "TypeError"})


class CodeIndex:
    """The parts of a file: expressions by line, assignments, functions, classes and names.

    ``assignments`` are the targets with their values. ``alternatives`` are names that
    several imports or classes bind, of which a condition may select one. ``passed_on`` are names
    that calls pass, ``tested`` those of which ``hasattr`` asks for an attribute.
    """

    def __init__(self, module: Module) -> None:
        self.module = module
        self.assignments: list[tuple[ast.expr, ast.stmt, ast.expr | None]] = []
        self.classes: list[ast.ClassDef] = []
        self.functions: list[Function] = []
        self.names: set[str] = set()
        self.alternatives = {*module.alternatives}
        self.passed_on: set[str] = set()
        self.tested: set[str] = set()
        self._expressions: dict[int, list[ast.expr]] = defaultdict(list)
        self._guarded: list[ast.Try] = []
        for node in ast.walk(module.tree):
            if isinstance(node, ast.expr):
                self._add_expression(node)
            else:
                self._add_statement(node)

    def _add_expression(self, node: ast.expr) -> None:
        self._expressions[node.lineno].append(node)
        if isinstance(node, ast.Name):
            self.names.add(node.id)
        elif isinstance(node, ast.Call):
            values = (*node.args, *(keyword.value for keyword in node.keywords))
            self.passed_on.update(dotted(value) for value in values)
            if dotted(node.func) == "hasattr" and node.args:
                self.tested.add(dotted(node.args[0]))

    def _add_statement(self, node: ast.AST) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    several = getattr(target, "elts", None) or [target]
                    self.assignments += [(item, node, value) for item in several]
            case ast.AnnAssign(target=target) | ast.AugAssign(target=target):
                self.assignments.append((target, node, node.value))
            case ast.ClassDef():
                if any(other.name == node.name for other in self.classes):
                    self.alternatives.add(node.name)
                self.classes.append(node)
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                self.functions.append(node)
                self.names.update(argument.arg for argument in arguments_of(node))
            case ast.Try() if any(catches(item, _ERRORS) for item in node.handlers):
                self._guarded.append(node)

    def expression_at(self, span: Span) -> ast.expr | None:
        """Return the outermost expression at a place."""
        nodes = self._expressions.get(span.line, ())
        return next((node for node in nodes if span_of(node, span.file) == span), None)

    def names_in(self, line: int) -> set[str]:
        """Return the dotted names that a line uses."""
        return {dotted(node) for node in self._expressions.get(line, ())} - {""}

    def is_guarded(self, line: int) -> bool:
        """Return whether a line is in a ``try`` that catches what a wrong type raises."""
        bodies = ((item.body[0], item.body[-1]) for item in self._guarded)
        return any(first.lineno <= line <= (last.end_lineno or line) for first, last in bodies)

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function that contains a line."""
        around = [node for node in self.functions if _holds(node, line)]
        return max(around, key=lambda node: node.lineno, default=None)

    def class_at(self, line: int) -> ast.ClassDef | None:
        """Return the innermost class that contains a line."""
        around = [node for node in self.classes if _holds(node, line)]
        return max(around, key=lambda node: node.lineno, default=None)

    def assigned_at(self, line: int) -> list[tuple[ast.expr, ast.stmt]]:
        """Return the targets that a line assigns, with the statements."""
        return [(target, node) for target, node, _ in self.assignments if _holds(node, line)]

    def values_of(self, name: str, line: int) -> list[ast.expr]:
        """Return the values of a local name or own attribute that a line may see."""
        scope = self.class_at(line) if "." in name else self.function_at(line)
        return [
            value
            for target, node, value in self.assignments
            if value is not None
            and dotted(target) == name
            and (scope is None or _holds(scope, node.lineno))
        ]

    def attributes_set(self) -> Iterator[str]:
        """Yield the methods and attributes that the code defines, of any object."""
        for target, node, _ in self.assignments:
            if not isinstance(node, ast.AugAssign):  # which reads the attribute first
                items = ast.walk(target)
                yield from (item.attr for item in items if isinstance(item, ast.Attribute))
        for class_ in self.classes:
            for item in class_.body:
                if isinstance(item, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
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


def _holds(node: ast.stmt, line: int) -> bool:
    return node.lineno <= line <= (node.end_lineno or node.lineno)
