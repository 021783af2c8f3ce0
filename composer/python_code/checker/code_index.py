"""The syntax of one file, by what a finding in a line needs to know."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from composer.base.source import Span
from composer.python_code.syntax import Module
from composer.python_code.trees import (
    Function,
    bindings,
    called_name,
    catches,
    dotted,
    last_name,
    span_of,
)

#: Statements whose code may be left out, or may fail.
_CONDITIONAL = (ast.If, ast.Match, ast.Try, ast.With)
#: Code that uses a value without looking at it.
_USES = (ast.Attribute, ast.BinOp, ast.Call, ast.FormattedValue, ast.Subscript, ast.keyword)
#: What code raises that uses a value of a wrong type.
_ERRORS = frozenset({"AttributeError", "NameError", "TypeError"})


class CodeIndex:
    """The parts of a file: statements by line, and names. The file is walked once."""

    def __init__(self, module: Module) -> None:
        self.module = module
        self._nodes = tuple(ast.walk(module.tree))
        self._places: dict[int, dict[Span, ast.expr]] = {}  # by line
        self._checked: dict[ast.AST, frozenset[str]] = {}  # by class or function
        self._made: dict[tuple[str, ast.AST], frozenset[str]] = {}  # by name and its scope

    @cached_property
    def names(self) -> frozenset[str]:
        """The names in the code, without those in texts."""
        names = {node.id for node in self._nodes if isinstance(node, ast.Name)}
        return frozenset(names | {node.arg for node in self._nodes if isinstance(node, ast.arg)})

    @cached_property
    def annotated_arguments(self) -> frozenset[str]:
        """Arguments with an annotation, of functions that no call passes on to rclpy."""
        calls = [node for node in self._nodes if isinstance(node, ast.Call)]
        passed = {dotted(value) for call in calls for value in call.args}
        passed |= {dotted(item.value) for call in calls for item in call.keywords}
        functions = (node for node in self._nodes if isinstance(node, Function))
        own = (item for item in functions if f"self.{item.name}" not in passed)
        arguments = (x for item in own for x in ast.walk(item.args) if isinstance(x, ast.arg))
        return frozenset(item.arg for item in arguments if item.annotation is not None)

    def around(self, line: int) -> Iterator[ast.stmt]:
        """Yield the statements that contain a line, from the inside to the outside."""
        return reversed(self._statements.get(line, ()))

    @cached_property
    def _statements(self) -> Mapping[int, Sequence[ast.stmt]]:
        found: dict[int, list[ast.stmt]] = {}
        for node in self._nodes:
            if isinstance(node, ast.stmt):
                for line in range(node.lineno, (node.end_lineno or node.lineno) + 1):
                    found.setdefault(line, []).append(node)
        return found

    def import_at(self, line: int) -> ast.Import | ast.ImportFrom | None:
        """Return the import in a line; None in a ``try`` or the like, where it may fail."""
        if any(isinstance(node, _CONDITIONAL) for node in self.around(line)):
            return None
        imports = (x for x in self.around(line) if isinstance(x, ast.Import | ast.ImportFrom))
        return next(imports, None)

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function that contains a line."""
        return next((node for node in self.around(line) if isinstance(node, Function)), None)

    def class_at(self, line: int) -> ast.ClassDef | None:
        """Return the innermost class that contains a line."""
        return next((node for node in self.around(line) if isinstance(node, ast.ClassDef)), None)

    def expression_at(self, span: Span) -> ast.expr | None:
        """Return the outermost expression at a place."""
        if span.line not in self._places:
            places = self._places[span.line] = {}
            for node in self._expressions.get(span.line, ()):
                places.setdefault(span_of(node, span.file), node)
        return self._places[span.line].get(span)

    @cached_property
    def _expressions(self) -> Mapping[int, list[ast.expr]]:
        found: dict[int, list[ast.expr]] = {}
        for node in self._nodes:
            if isinstance(node, ast.expr):
                found.setdefault(node.lineno, []).append(node)
        return found

    def has_loose_names(self, line: int) -> bool:
        """Return whether a line uses a name that gets objects of different classes.

        Which one it has may depend on a condition, such as the distribution of ROS.
        """
        alternatives = self.module.alternatives.keys()
        for name in filter(None, map(dotted, self._expressions.get(line, ()))):
            place = self.class_at(line) if "." in name else self.function_at(line)
            key = name, place or self.module.tree
            if key not in self._made:
                values = filter(None, bindings(key[1]).get(name, ()))
                self._made[key] = frozenset(map(_made_class, values)) - {""}
            made = self._made[key]
            if len(made) > 1 or made & alternatives or name.partition(".")[0] in alternatives:
                return True
        return False

    def is_guarded(self, line: int) -> bool:
        """Return whether the code around a line catches what the lack of an attribute raises.

        Which attributes an object has may depend on the version of a package.
        """
        attempts = (node for node in self.around(line) if isinstance(node, ast.Try))
        return any(catches(handler, _ERRORS) for node in attempts for handler in node.handlers)

    def is_checked(self, scope: ast.AST, name: str) -> bool:
        """Return whether a class or function compares a value, tests it or stores it elsewhere."""
        if scope not in self._checked:
            self._checked[scope] = frozenset(map(dotted, _checks_in(scope)))
        return name in self._checked[scope]

    def attributes_set(self) -> Iterator[str]:
        """Yield the methods and attributes that the code defines, of any object."""
        changed = {node.target for node in self._nodes if isinstance(node, ast.AugAssign)}
        for node in self._nodes:
            if isinstance(node, ast.Attribute) and node not in changed:
                yield from (node.attr,) if isinstance(node.ctx, ast.Store) else ()
            for statement in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(statement, Function | ast.ClassDef):
                    yield statement.name
                elif isinstance(statement, ast.Assign | ast.AnnAssign):
                    yield from (x.id for x in ast.walk(statement) if isinstance(x, ast.Name))

    @property
    def sets_computed_names(self) -> bool:
        """Whether the file sets attributes by name, so that any may exist."""
        return bool({"setattr", "vars"} & self.names) or "__dict__" in self.module.source.text


def _made_class(value: ast.expr) -> str:
    """Return the class of which a call makes an object, or the type of a port; else ""."""
    if not isinstance(value, ast.Call):
        return ""
    is_port = called_name(value).startswith("create_") and value.args
    name = last_name(value.args[0] if is_port else value.func)
    return name if name[:1].isupper() else ""


def _checks_in(scope: ast.AST) -> Iterator[ast.AST]:
    """Yield the expressions that code compares, tests, stores or returns: not only uses."""
    for node in ast.walk(scope):
        if not isinstance(node, _USES):
            parts = (x for x in ast.iter_child_nodes(node) if isinstance(x, ast.expr))
            yield from (x for x in parts if not isinstance(getattr(x, "ctx", None), ast.Store))
