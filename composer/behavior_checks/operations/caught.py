"""Checks which exceptions a ``try`` catches."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator, Sequence

from composer import behavior
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.values import Collection, OwnObject, Value


def exception_class(name: str) -> type[BaseException] | None:
    """Return the exception of Python or of the API with that full name, None for other names."""
    module, _, last = name.rpartition(".")
    home = {"": builtins, "composer.behavior": behavior}.get(module)
    found = getattr(home, last, None)
    return found if isinstance(found, type) and issubclass(found, BaseException) else None


def unreachable_handlers(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the classes in ``except`` that an earlier ``except`` catches as well."""
    if not isinstance(node, ast.Try):
        return
    earlier: list[type[BaseException]] = []
    for handler in node.handlers:
        caught = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
        yield from _not_exceptions([item for item in caught if item is not None], scope)
        found = [(item, exception_class(scope.called_name(item))) for item in caught if item]
        for item, known in found:
            general = next((other for other in earlier if known and issubclass(known, other)), None)
            if known is not None and general is not None and known is not general:
                message = f"{known.__name__} never gets here: {general.__name__} catches it"
                hint = f"move 'except {known.__name__}' before 'except {general.__name__}'"
                yield CodeProblem(Kind.UNUSED, message, span_of(item, scope.home.source), hint)
        earlier.extend(known for _, known in found if known is not None)


def _not_exceptions(caught: Sequence[ast.expr], scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield what ``except`` names that is not a class of exceptions."""
    for item in caught:
        found = scope.type_of(item)
        if isinstance(item, ast.List | ast.Set | ast.Dict):
            problem, hint = f"'except' needs a tuple, not a {_NAMES[type(item)]}", "write (...)"
        elif isinstance(item, ast.Call) and exception_class(scope.called_name(item.func)):
            problem, hint = "'except' needs a class, not an exception", "remove '()'"
        elif isinstance(found, OwnObject) and isinstance(item, ast.Call):
            problem, hint = f"'except' needs a class, not {shown(found)}", "remove '()'"
        elif _is_value(found):
            problem, hint = f"'except' needs a class, not {shown(found)}", None
        else:
            continue
        yield CodeProblem(Kind.VALUE, problem, span_of(item, scope.home.source), hint)


def _is_value(found: Value) -> bool:
    """Return whether a value is neither a class nor a tuple, which may be of classes."""
    is_tuple = isinstance(found, Collection) and found.python is tuple
    return not is_tuple and kind_of(found) in {"collection", "dict", "number", "text"}


_NAMES: dict[type[ast.expr], str] = {ast.Dict: "dict", ast.List: "list", ast.Set: "set"}
