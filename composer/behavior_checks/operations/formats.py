"""Checks how values are formatted, and what is raised."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator

from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.scalars import is_float, is_integer, is_number, is_text
from composer.behavior_types.syntax.names import constant_named
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.values import NONE, Collection, OwnObject, Value
from composer.interfaces import Message

#: Functions of logging whose first argument is a format of the others.
_LEVELS = frozenset({"critical", "debug", "error", "exception", "info", "warning"})
_CONVERSION = re.compile(
    r"%(?P<key>\([^)]*\))?[-#0 +]*(?P<star>\*|\d+)?(?:\.(?:\*|\d+))?[hlL]?(?P<type>.)"
)


def text_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why a value cannot be formatted, or raised."""
    match node:
        case ast.FormattedValue(value=value, conversion=-1, format_spec=ast.JoinedStr() as written):
            problem = _format_problem(scope.type_of(value), written)
        case ast.Call(
            func=ast.Attribute(value=ast.Constant(value=str() as text) as value, attr="format")
        ):
            problem = _call_problem(text, node, scope)
        case ast.Call(
            func=ast.Attribute(attr=level) as function, args=[ast.Constant(str()) as value, *items]
        ) if level in _LEVELS and items and _is_logging(function, scope):
            problem = percent_problem(value, ast.Mod(), ast.Tuple(items), scope)
        case ast.Raise(exc=ast.expr() as value):
            problem = _raise_problem(scope.type_of(value))
        case _:
            return
    if problem is not None:
        yield CodeProblem(Kind.VALUE, problem, span_of(value, scope.home.source))


def _is_logging(function: ast.Attribute, scope: FunctionTypes) -> bool:
    """Return whether a function is of the module ``logging``, or of a logger of the file."""
    if (scope.called_name(function) or "").startswith("logging."):
        return True
    owner = function.value.id if isinstance(function.value, ast.Name) else ""
    made = None if scope.is_local(owner) else constant_named(owner, scope.home)
    return isinstance(made, ast.Call) and scope.called_name(made.func) == "logging.getLogger"


def _call_problem(text: str, call: ast.Call, scope: FunctionTypes) -> str | None:
    """Return why ``"...".format(...)`` fails, None if it may be right."""
    try:
        fields = list(_replacements(text))
    except ValueError as error:
        return f"this is not a format: {error}"
    names = {item.arg: item.value for item in call.keywords}
    is_open = any(isinstance(item, ast.Starred) for item in call.args)
    numbered = [name for name, _ in fields if name.isdigit()]
    automatic = [name for name, _ in fields if not name]
    if numbered and automatic:
        return "numbered and automatic fields cannot be mixed"
    needed = max([len(automatic), *(int(name) + 1 for name in numbered)])
    if needed > len(call.args) and not is_open:
        return f"{_counted(len(call.args), 'value')} for {_counted(needed, 'placeholder')}"
    at = 0
    for name, spec in fields:
        value = names.get(name)
        if not name or name.isdigit():
            place = int(name) if name else at
            at += not name
            value = call.args[place] if place < len(call.args) and not is_open else None
        elif value is None and None not in names and name.isidentifier():
            return f"no value is given for '{name}'"
        problem = _spec_problem(scope.type_of(value), spec) if value is not None else None
        if problem is not None:
            return problem
    return None


def _replacements(text: str) -> Iterator[tuple[str, str]]:
    """Yield the names of the fields of a format, and how each is written.

    A field with an attribute, an index or a conversion may be written in any way: "".
    """
    formatter = importlib.import_module("string").Formatter()  # it takes time to import
    for _, field, spec, conversion in formatter.parse(text):
        if field is None:
            continue
        name = re.split(r"[.\[]", field, maxsplit=1)[0]
        inner = list(_replacements(spec)) if spec else []
        is_plain = name == field and not conversion and not inner
        yield name, (spec or "") if is_plain else ""
        yield from ((other, "") for other, _ in inner)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")


def _format_problem(value: Value, written: ast.JoinedStr) -> str | None:
    """Return why ``{value:format}`` fails, None if it may be right."""
    spec = "".join(
        str(part.value) if isinstance(part, ast.Constant) else "?" for part in written.values
    )
    return None if "?" in spec else _spec_problem(value, spec)


def _spec_problem(value: Value, spec: str) -> str | None:
    if not spec:
        return None
    is_plain = isinstance(value, OwnObject) and _has_no_format(value)
    is_collection = isinstance(value, Collection) and value.python in (list, dict, tuple, set)
    if isinstance(value, Message) or is_plain or is_collection or value is NONE:
        what = "None" if value is NONE else shown(value)
        return f"{what} cannot be formatted with ':{spec}'"
    if is_text(value) and spec[-1] in "bcdeEfFgGnoxX%":
        return f"a string cannot be formatted with ':{spec}'"
    if is_number(value) and spec[-1] == "s":
        return f"{shown(value)} cannot be formatted with ':{spec}'"
    if is_float(value) and spec[-1] in "bcdoxX":
        return f"a float cannot be formatted with ':{spec}'"
    if is_integer(value) and spec[-1] == "d" and "." in spec:
        return f"an integer has no decimals, as in ':{spec}'"
    return None


def _has_no_format(value: OwnObject) -> bool:
    own = {method.name for method in value.of.definition.methods}
    return (
        known_attributes(value.of) is not None
        and "__format__" not in own
        and not (value.of.definition.bases)
    )


def percent_problem(
    left: ast.expr, operator: ast.operator, right: ast.expr, scope: FunctionTypes
) -> str | None:
    """Return why ``"..." % (...)`` has too few or too many values, None if it may be right."""
    value = scope.type_of(right)
    is_one = kind_of(value) in {"number", "text"} or isinstance(value, Message)
    if not isinstance(operator, ast.Mod) or not (isinstance(right, ast.Tuple) or is_one):
        return None
    if not isinstance(left, ast.Constant) or not isinstance(left.value, str):
        return None
    items = right.elts if isinstance(right, ast.Tuple) else [right]
    if any(isinstance(item, ast.Starred) for item in items):
        return None
    found = [item for item in _CONVERSION.finditer(left.value) if item["type"] != "%"]
    if any(item["key"] or "*" in item[0] for item in found):
        return None
    if len(found) == len(items):
        types = [scope.type_of(item) for item in items]
        wrong = (_conversion_problem(*pair) for pair in zip(types, found, strict=True))
        return next((problem for problem in wrong if problem is not None), None)
    return f"{_counted(len(items), 'value')} for {_counted(len(found), 'placeholder')}"


def _conversion_problem(value: Value, written: re.Match[str]) -> str | None:
    """Return why ``%d`` and the like fail for a value, None if they may be right."""
    is_known = kind_of(value) not in (None, "number", "bytes") and not isinstance(value, OwnObject)
    if written["type"] not in "diouxXeEfFgG" or not (is_known or value is NONE):
        return None
    what = "None" if value is NONE else shown(value)
    return f"{what} cannot be formatted with '{written[0]}'"


def _raise_problem(value: Value) -> str | None:
    """Return why a value cannot be raised, None if it may be an exception."""
    if kind_of(value) in (None, "function") or isinstance(value, OwnObject):
        return None
    return f"{shown(value)} is raised, which is not an exception"
