"""Copies of Python files in which classes know their surroundings.

In a copy, a behavior derives from the generated base class of its node type, and arguments of
handlers and of rclpy callbacks without an annotation get one. Places in it are mapped back.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Container, Iterator, Mapping
from dataclasses import field
from typing import TypeGuard

from composer.base.fast_dataclass import dataclass
from composer.python_code.checker.callbacks import callback_signatures
from composer.python_code.checker.file_sets import ClassEdit
from composer.python_code.nodes import Signature
from composer.python_code.stubs.messages import interface_modules
from composer.python_code.syntax import Module
from composer.python_code.trees import (
    Function,
    characters,
    dotted,
    is_none,
    positional_arguments,
    public_module,
    walk,
)

#: The line that a copy gets, so that annotations can name what they need.
_IMPORTS = (
    "import composer.behavior, composer.typed, rclpy.action, rclpy.lifecycle, "
    "rclpy.parameter, rclpy.task, typing"
)


@dataclass(slots=True)
class Copy:
    """The text of a copy, and how its lines and columns relate to those of the original file."""

    module: Module
    text: str
    inserted_lines: tuple[int, ...]  # of the copy, in order
    columns: Mapping[int, list[tuple[int, int]]]  # of original lines: column, length

    def is_inserted(self, line: int, column: int) -> bool:
        """Return whether the original lacks what is at a place of the copy."""
        places = self.columns.get(self._original_line(line), ())
        is_inside = any(start <= column < start + length for start, length in places)
        return line in self.inserted_lines or is_inside

    def _original_line(self, line: int) -> int:
        return max(line - sum(inserted <= line for inserted in self.inserted_lines), 1)

    def place(self, line: int, column: int) -> tuple[int, int]:
        """Return the line and column in the original, counted from 1."""
        line = self._original_line(line)
        shift = sum(length for start, length in self.columns.get(line, ()) if start <= column)
        return line, max(column - shift, 1)


def edited_copy(module: Module, classes: Mapping[str, ClassEdit], *, is_behavior: bool) -> Copy:
    """Return the copy of a file. ``classes`` are its classes with a known surrounding."""
    edits = _Edits(list(module.source.text.split("\n")))
    edits.import_interfaces(module.tree)
    names: set[str] = set()
    for class_ in module.classes.values():
        edits.remove_unset_attributes(class_.node, stays_none=is_behavior)
        edit = classes.get(class_.name, ClassEdit())
        if edit.base and edit.base.rpartition(".")[2] not in class_.bases:
            edits.add_base(class_.node, edit.base)
        signatures = {
            **callback_signatures(class_.node, module, edit.ports),
            **edit.signatures,
        }
        for method in class_.methods:
            signature = signatures.get(method.name)
            if signature is not None and method.node is not None:
                edits.annotate(method.node, signature)
                types = [signature.result, *(type_ for _, type_ in signature.arguments)]
                names.update(interface_modules(" ".join(types)))
    imports = ", ".join((_IMPORTS, *sorted(names)))
    edits.added.append((_lines_of_head(module.tree), imports))
    lines, columns = edits.apply()
    inserted = []
    for number, (after, text) in enumerate(sorted(edits.added)):
        lines.insert(after + number, text)
        inserted.append(after + number + 1)
    return Copy(module, "\n".join(lines), tuple(inserted), columns)


@dataclass(slots=True)
class _Edits:
    """Texts to insert, by line and column: lines from 1, columns from 0, in characters."""

    lines: list[str]
    insertions: list[tuple[int, int, str]] = field(default_factory=list)
    added: list[tuple[int, str]] = field(default_factory=list)  # lines, after a number of lines

    def import_interfaces(self, tree: ast.Module) -> None:
        """Import interfaces from modules that have stubs: see ``public_module``."""
        for node in walk(tree.body, closed=(ast.expr,)):
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                public = public_module(node.module)
                if public != node.module:
                    line = self.lines[node.lineno - 1]
                    name = public.ljust(len(node.module))
                    self.lines[node.lineno - 1] = line.replace(node.module, name, 1)

    def remove_unset_attributes(self, node: ast.ClassDef, *, stays_none: bool) -> None:
        """Remove ``self.last = None`` from the constructor if another method sets a value.

        Otherwise the checker takes None as the type of the attribute, whatever the others set. If
        ``stays_none``, a method of its own says that the value may be None.
        """
        set_elsewhere = set(_attributes_set(node))
        unset = [item for item in _constructor(node) if _is_unset(item, set_elsewhere)]
        for item in unset:
            line = self.lines[item.lineno - 1]
            start, end = item.col_offset, item.end_col_offset or item.col_offset
            self.lines[item.lineno - 1] = line[:start] + "pass".ljust(end - start) + line[end:]
        if unset and stays_none:
            indentation = " " * node.body[0].col_offset
            statements = "; ".join(f"{ast.unparse(item.targets[0])} = none" for item in unset)
            method = f"{indentation}def _composer_unset(self, none: None): {statements}"
            self.added.append((node.end_lineno or node.lineno, method))

    def apply(self) -> tuple[list[str], Mapping[int, list[tuple[int, int]]]]:
        """Return the changed lines, and for each line what was inserted where in the result."""
        columns: dict[int, list[tuple[int, int]]] = {}
        lines = list(self.lines)
        shifts: dict[int, int] = {}
        for line, column, text in sorted(self.insertions):
            at = column + shifts.get(line, 0)
            old = lines[line - 1]
            lines[line - 1] = old[:at] + text + old[at:]
            columns.setdefault(line, []).append((at + 1, len(text)))
            shifts[line] = shifts.get(line, 0) + len(text)
        return lines, columns

    def add_base(self, node: ast.ClassDef, base: str) -> None:
        """Add the first base class of a class."""
        line = self.lines[node.lineno - 1]
        named = re.search(rf"\bclass\s+{node.name}\b\s*(?:\[.*?\]\s*)?(\()?", line)
        if named is not None:
            comma = ", " if node.bases or node.keywords else ""
            text = f"{base}{comma}" if named[1] else f"({base})"
            self.insertions.append((node.lineno, named.end(), text))

    def annotate(self, function: Function, signature: Signature) -> None:
        """Annotate the arguments of a method, and its result."""
        arguments = positional_arguments(function)
        if not any(_is_static(decorator) for decorator in function.decorator_list):
            arguments = arguments[1:]
        without_default = len(arguments) - len(function.args.defaults)
        assigned = _assigned_names(function)
        pairs = zip(arguments, signature.arguments, strict=False)
        for index, (argument, (_, type_)) in enumerate(pairs):
            # An argument that the method assigns itself may get a value of another type.
            end = argument.end_lineno or argument.lineno, argument.end_col_offset or 0
            if argument.annotation is not None:
                self._insert(*end, _type_arguments(argument.annotation, type_))
            elif type_ and argument.arg not in assigned and index < without_default:
                self._insert(*end, f": {type_}")
        if signature.result in ("", "None"):
            return
        place = _end_of_signature(function, self.lines)
        if function.returns is None and place is not None:
            self.insertions.append((*place, f" -> {signature.result}"))
        elif function.returns is not None and is_none(function.returns):  # by habit
            number, line = function.returns.lineno, self.lines[function.returns.lineno - 1]
            start = characters(line, function.returns.col_offset)
            self.lines[number - 1] = f"{line[:start]}    {line[start + 4 :]}"
            self.insertions.append((number, start, signature.result))

    def _insert(self, line: int, size_bytes: int, text: str) -> None:
        if not text:
            return
        column = characters(self.lines[line - 1], size_bytes)
        self.insertions.append((line, column, text))


def _constructor(node: ast.ClassDef) -> list[ast.stmt]:
    """Return the statements of the constructor of a class."""
    found = (item for item in node.body if getattr(item, "name", "") == "__init__")
    return next((item.body for item in found if isinstance(item, ast.FunctionDef)), [])


def _attributes_set(node: ast.ClassDef) -> Iterator[str]:
    """Yield the attributes that methods set to something else than None."""
    for item in ast.walk(node):
        if isinstance(item, ast.Assign) and not is_none(item.value):
            yield from (dotted(target) for target in item.targets)


def _is_unset(statement: ast.stmt, attributes: Container[str]) -> TypeGuard[ast.Assign]:
    """Return whether a statement is ``self.name = None`` for one of the attributes."""
    match statement:
        case ast.Assign(targets=[ast.Attribute() as target], value=ast.Constant(value=None)):
            is_one_line = statement.end_lineno == statement.lineno
            return is_one_line and dotted(target) in attributes
    return False


def _type_arguments(annotation: ast.expr, type_: str) -> str:
    """Return what an annotation such as ``ServerGoalHandle`` lacks: the types in brackets."""
    name, bracket, rest = type_.partition("[")
    is_same = dotted(annotation).rpartition(".")[2] == name.rpartition(".")[2]
    return f"{bracket}{rest}" if is_same else ""


def _is_static(decorator: ast.expr) -> bool:
    return isinstance(decorator, ast.Name) and decorator.id == "staticmethod"


def _assigned_names(function: Function) -> frozenset[str]:
    return frozenset(
        node.id
        for node in ast.walk(function)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    )


def _end_of_signature(function: Function, lines: list[str]) -> tuple[int, int] | None:
    """Return the place after the closing parenthesis of a function, None if it is not found."""
    arguments = [*positional_arguments(function), *function.args.kwonlyargs]
    defaults = [*function.args.defaults, *function.args.kw_defaults]
    parts = (item for item in (*arguments, *defaults) if item is not None)
    ends = [(item.end_lineno or 0, item.end_col_offset or 0) for item in parts]
    first, column = max(ends, default=(function.lineno, function.col_offset))
    for number in range(first, function.body[0].lineno + 1):
        line = lines[number - 1]
        start = characters(line, column) if number == first else 0
        closing = re.compile(r"\)(?=\s*:)").search(line, start)
        if closing is not None:
            return number, closing.end()
    return None


def _lines_of_head(tree: ast.Module) -> int:
    """Return the number of lines before the first statement that may follow an import."""
    last = 0
    for statement in tree.body:
        is_docstring = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
        is_future = isinstance(statement, ast.ImportFrom) and statement.module == "__future__"
        if not (is_docstring or is_future):
            break
        last = statement.end_lineno or last
    return last
