"""The syntax of one file, by what a finding in a line needs to know."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
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
        self._places: dict[int, dict[Span, ast.expr]] = {}  # by line
        self._balances: dict[ast.AST, Counter[str]] = {}  # by class or function
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
    def class_names(self) -> frozenset[str]:
        """The names in the code that look like classes."""
        return frozenset(name for name in self.names if name[:1].isupper())

    @cached_property
    def names_by_initial(self) -> Mapping[str, tuple[str, ...]]:
        """What names may mean, by the first letter in lower case."""
        found: dict[str, list[str]] = {}
        for name in sorted({*self.names, *self.module.imports, *self.module.classes}):
            found.setdefault(name[:1].lower(), []).append(name)
        return {initial: tuple(names) for initial, names in found.items()}

    @cached_property
    def alternatives(self) -> frozenset[str]:
        """Names that several imports or classes bind: a condition may select one of them."""
        counts = Counter(node.name for node in self.classes)
        several = (name for name, count in counts.items() if count > 1)
        return frozenset({*self.module.alternatives, *several})

    @cached_property
    def passed_on(self) -> frozenset[str]:
        """Names that calls pass."""
        positional = (value for call in self._calls for value in call.args)
        by_name = (keyword.value for call in self._calls for keyword in call.keywords)
        return frozenset(map(dotted, (*positional, *by_name)))

    @cached_property
    def tested(self) -> frozenset[str]:
        """The names whose attributes ``hasattr`` asks for."""
        tests = (call for call in self._calls if dotted(call.func) == "hasattr" and call.args)
        return frozenset(dotted(call.args[0]) for call in tests)

    @cached_property
    def annotated_arguments(self) -> frozenset[str]:
        """Arguments with an annotation, of functions that no call passes on to rclpy."""
        functions = (x for x in self.functions if f"self.{x.name}" not in self.passed_on)
        arguments = (argument for function in functions for argument in arguments_of(function))
        return frozenset(item.arg for item in arguments if item.annotation is not None)

    def import_at(self, line: int) -> ast.Import | ast.ImportFrom | None:
        """Return the import in a line; None in a ``try`` or the like, where it may fail."""
        return next(iter(self._imports.get(line, ())), None)

    @cached_property
    def _imports(self) -> Mapping[int, list[ast.Import | ast.ImportFrom]]:
        always = walk(self.module.tree.body, closed=(ast.If, ast.Match, ast.Try, ast.With))
        return _by_line(x for x in always if isinstance(x, ast.Import | ast.ImportFrom))

    def expression_at(self, span: Span) -> ast.expr | None:
        """Return the outermost expression at a place."""
        if span.line not in self._places:
            places = self._places[span.line] = {}
            for node in self._expressions_by_line.get(span.line, ()):
                places.setdefault(span_of(node, span.file), node)
        return self._places[span.line].get(span)

    @cached_property
    def _expressions_by_line(self) -> Mapping[int, list[ast.expr]]:
        found: dict[int, list[ast.expr]] = {}
        for node in self._expressions:
            found.setdefault(node.lineno, []).append(node)
        return found

    def has_loose_names(self, line: int) -> bool:
        """Return whether a line uses a name that gets objects of different classes.

        Which one it has may depend on a condition, such as the distribution of ROS.
        """
        return line in self._loose_lines

    @cached_property
    def _loose_lines(self) -> frozenset[int]:
        several: dict[tuple[str, ast.stmt | None], bool] = {}
        lines = set()
        for node in self._expressions:
            name = dotted(node)
            if not name or node.lineno in lines:
                continue
            key = (name, self._scope(name, node.lineno))
            if key not in several:
                several[key] = self._has_several_classes(self.values_of(name, node.lineno))
            if several[key] or name.partition(".")[0] in self.alternatives:
                lines.add(node.lineno)
        return frozenset(lines)

    def _has_several_classes(self, values: Iterable[ast.expr]) -> bool:
        classes: set[str] = set()
        for value in values:
            made = dotted(value.func) if isinstance(value, ast.Call) else ""
            last = made.rpartition(".")[2]
            if made in self.alternatives:
                return True
            if isinstance(value, ast.Call) and last.startswith("create_"):
                classes.add(ast.unparse(value.args[0]) if value.args else last)
            elif last[:1].isupper():
                classes.add(made)
        return len(classes) > 1

    def is_guarded(self, line: int) -> bool:
        """Return whether a line is in a ``try`` that catches what a wrong type raises."""
        return line in self._guarded

    @cached_property
    def _guarded(self) -> Mapping[int, list[ast.stmt]]:
        tries = (node for node in self._nodes if isinstance(node, ast.Try))
        guards = (x for x in tries if any(catches(handler, _ERRORS) for handler in x.handlers))
        return _by_line(statement for guard in guards for statement in guard.body)

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function that contains a line."""
        return next(reversed(self._functions.get(line, ())), None)

    @cached_property
    def _functions(self) -> Mapping[int, list[Function]]:
        return _by_line(sorted(self.functions, key=lambda node: node.lineno))

    def class_at(self, line: int) -> ast.ClassDef | None:
        """Return the innermost class that contains a line."""
        return next(reversed(self._classes.get(line, ())), None)

    @cached_property
    def _classes(self) -> Mapping[int, list[ast.ClassDef]]:
        return _by_line(sorted(self.classes, key=lambda node: node.lineno))

    def assigned_at(self, line: int) -> list[tuple[ast.expr, ast.stmt]]:
        """Return the targets that a line assigns, with the statements."""
        statements = dict.fromkeys(self._assigning.get(line, ()))
        return [(target, node) for node in statements for target in self._targets[node]]

    @cached_property
    def _assigning(self) -> Mapping[int, list[ast.stmt]]:
        return _by_line(self._targets)

    @cached_property
    def _targets(self) -> Mapping[ast.stmt, list[ast.expr]]:
        found: dict[ast.stmt, list[ast.expr]] = {}
        for target, node, _ in self.assignments:
            found.setdefault(node, []).append(target)
        return found

    def values_of(self, name: str, line: int) -> list[ast.expr]:
        """Return the values of a local name or own attribute that a line may see."""
        return self._values.get((name, self._scope(name, line)), [])

    def _scope(self, name: str, line: int) -> ast.stmt | None:
        return self.class_at(line) if "." in name else self.function_at(line)

    @cached_property
    def _values(self) -> Mapping[tuple[str, ast.stmt | None], list[ast.expr]]:
        found: dict[tuple[str, ast.stmt | None], list[ast.expr]] = {}
        for target, node, value in self.assignments:
            name = dotted(target)
            around = self._classes if "." in name else self._functions
            for scope in (None, *around.get(node.lineno, ())):
                if value is not None:
                    found.setdefault((name, scope), []).append(value)
        return found

    def is_checked(self, scope: ast.AST, name: str) -> bool:
        """Return whether a class or function reads a value other than by its members.

        It then compares the value, tests it or stores it elsewhere.
        """
        if scope not in self._balances:
            self._balances[scope] = _loads_without_uses(scope)
        return self._balances[scope][name] > 0

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


def _by_line(nodes: Iterable[_Statement]) -> Mapping[int, list[_Statement]]:
    """Return the statements that contain each line."""
    found: dict[int, list[_Statement]] = {}
    for node in nodes:
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1):
            found.setdefault(line, []).append(node)
    return found


def _loads_without_uses(scope: ast.AST) -> Counter[str]:
    """Return how often each name is read other than by its members or as an argument."""
    balance: Counter[str] = Counter()
    for node in ast.walk(scope):
        if isinstance(node, ast.Attribute | ast.Name) and isinstance(node.ctx, ast.Load):
            balance[dotted(node)] += 1
        match node:
            case ast.Attribute(value=value) | ast.Subscript(value=value):
                used = [value]
            case ast.BinOp(left=left, right=right):
                used = [left, right]
            case ast.Call(func=function, args=arguments, keywords=keywords):
                used = [function, *arguments, *(keyword.value for keyword in keywords)]
            case _:
                used = []
        balance.subtract(map(dotted, used))
    return balance


def _holds(node: ast.stmt, line: int) -> bool:
    return node.lineno <= line <= (node.end_lineno or node.lineno)
