"""The syntax of one file, by what a finding in a line needs to know."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import TypeVar

from composer.base.source import Span
from composer.python_code.syntax import Module
from composer.python_code.trees import (
    Function,
    called_name,
    catches,
    dotted,
    last_name,
    positional_arguments,
    span_of,
    walk,
)

_Statement = TypeVar("_Statement", bound=ast.stmt)
_Assignment = ast.Assign | ast.AnnAssign | ast.AugAssign
#: What code raises that uses a value of a wrong type.
_ERRORS = frozenset({"AttributeError", "NameError", "TypeError"})


class CodeIndex:
    """The parts of a file: assignments, functions, classes and names. The file is walked once."""

    def __init__(self, module: Module) -> None:
        self.module = module
        self._nodes = tuple(ast.walk(module.tree))
        self._expressions = [node for node in self._nodes if isinstance(node, ast.expr)]
        self._calls = [node for node in self._expressions if isinstance(node, ast.Call)]
        self._assignments = [node for node in self._nodes if isinstance(node, _Assignment)]
        self._places: dict[int, dict[Span, ast.expr]] = {}  # by line
        self._checked: dict[ast.AST, frozenset[str]] = {}  # by class or function
        self.classes = [node for node in self._nodes if isinstance(node, ast.ClassDef)]
        self.functions = [node for node in self._nodes if isinstance(node, Function)]

    @cached_property
    def names(self) -> frozenset[str]:
        """The names in the code, without those in texts."""
        names = {node.id for node in self._expressions if isinstance(node, ast.Name)}
        return frozenset(names | {x.arg for item in self.functions for x in arguments_of(item)})

    @cached_property
    def annotated_arguments(self) -> frozenset[str]:
        """Arguments with an annotation, of functions that no call passes on to rclpy."""
        passed = {dotted(value) for call in self._calls for value in call.args}
        passed |= {dotted(item.value) for call in self._calls for item in call.keywords}
        functions = (item for item in self.functions if f"self.{item.name}" not in passed)
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
        alternatives = self.module.alternatives.keys()
        made = {key: {*map(_made_class, values)} - {""} for key, values in self._values.items()}
        loose = {key for key, names in made.items() if len(names) > 1 or names & alternatives}
        lines = set()
        for node in self._expressions:
            name = dotted(node)
            is_loose = (name, self._scope(name, node.lineno)) in loose
            if is_loose or name.partition(".")[0] in alternatives:
                lines.add(node.lineno)
        return frozenset(lines)

    def is_guarded(self, line: int) -> bool:
        """Return whether a line is where code asks for attributes, or catches what a lack raises.

        Which attributes an object has may depend on the version of a package.
        """
        return line in self._guarded

    @cached_property
    def _guarded(self) -> Mapping[int, list[ast.stmt]]:
        tries = (node for node in self._nodes if isinstance(node, ast.Try))
        guards = (x for x in tries if any(catches(handler, _ERRORS) for handler in x.handlers))
        asking = (self.function_at(x.lineno) for x in self._calls if called_name(x) == "hasattr")
        guarded = [statement for guard in guards for statement in guard.body]
        return _by_line([*guarded, *filter(None, asking)])

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

    def assignment_at(self, line: int) -> _Assignment | None:
        """Return the assignment in a line."""
        return next(iter(self._assigning.get(line, ())), None)

    @cached_property
    def _assigning(self) -> Mapping[int, list[_Assignment]]:
        return _by_line(self._assignments)

    def values_of(self, name: str, line: int) -> list[ast.expr]:
        """Return the values of a local name or own attribute that a line may see."""
        return self._values.get((name, self._scope(name, line)), [])

    def _scope(self, name: str, line: int) -> ast.stmt | None:
        return self.class_at(line) if "." in name else self.function_at(line)

    @cached_property
    def _values(self) -> Mapping[tuple[str, ast.stmt | None], list[ast.expr]]:
        found: dict[tuple[str, ast.stmt | None], list[ast.expr]] = {}
        for node in self._assignments:
            for name in map(dotted, targets_of(node)):
                around = self._classes if "." in name else self._functions
                for scope in (None, *around.get(node.lineno, ())):
                    if node.value is not None:
                        found.setdefault((name, scope), []).append(node.value)
        return found

    def is_checked(self, scope: ast.AST, name: str) -> bool:
        """Return whether a class or function compares a value, tests it or stores it elsewhere."""
        if scope not in self._checked:
            self._checked[scope] = frozenset(map(dotted, _checks_in(scope)))
        return name in self._checked[scope]

    def attributes_set(self) -> Iterator[str]:
        """Yield the methods and attributes that the code defines, of any object."""
        for node in self._assignments:
            if not isinstance(node, ast.AugAssign):  # which reads the attribute first
                items = (item for target in targets_of(node) for item in ast.walk(target))
                yield from (item.attr for item in items if isinstance(item, ast.Attribute))
        for statement in (item for class_ in self.classes for item in class_.body):
            if isinstance(statement, Function | ast.ClassDef):
                yield statement.name
            elif isinstance(statement, ast.Assign | ast.AnnAssign):
                yield from (x.id for x in ast.walk(statement) if isinstance(x, ast.Name))

    @property
    def sets_computed_names(self) -> bool:
        """Whether the file sets attributes by name, so that any may exist."""
        return bool({"setattr", "vars"} & self.names) or "__dict__" in self.module.source.text


def arguments_of(function: Function) -> list[ast.arg]:
    """Return the arguments of a function that have a name."""
    return [*positional_arguments(function), *function.args.kwonlyargs]


def targets_of(node: _Assignment) -> list[ast.expr]:
    """Return what an assignment gives values to."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [item for target in targets for item in getattr(target, "elts", (target,))]


def _by_line(nodes: Iterable[_Statement]) -> Mapping[int, list[_Statement]]:
    """Return the statements that contain each line."""
    found: dict[int, list[_Statement]] = {}
    for node in nodes:
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1):
            found.setdefault(line, []).append(node)
    return found


def _made_class(value: ast.expr) -> str:
    """Return the class of which a call makes an object, or the type of a port; else ""."""
    if not isinstance(value, ast.Call):
        return ""
    is_port = called_name(value).startswith("create_") and value.args
    name = last_name(value.args[0] if is_port else value.func)
    return name if name[:1].isupper() else ""


def _checks_in(scope: ast.AST) -> Iterator[ast.AST]:
    """Yield the expressions that code compares, tests, stores or returns."""
    for node in ast.walk(scope):
        match node:
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp():
                yield from ast.iter_child_nodes(node)
            case ast.If(test=value) | ast.IfExp(test=value) | ast.While(test=value):
                yield value
            case ast.Assert(test=value) | ast.Match(subject=value) | ast.comprehension(iter=value):
                yield value
            case ast.Assign(value=value) | ast.AnnAssign(value=value) | ast.Return(value=value):
                yield from (value, *getattr(value, "elts", ())) if value is not None else ()
