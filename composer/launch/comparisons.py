"""What the conditions of launch files compare arguments with: values that choose other nodes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

from launch import LaunchContext
from launch.substitutions import (
    AndSubstitution,
    EqualsSubstitution,
    LaunchConfiguration,
    NotEqualsSubstitution,
    NotSubstitution,
    OrSubstitution,
    PythonExpression,
    TextSubstitution,
)
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

#: A comparison of an argument, as ``${name}``, with a constant, in an expression of Python.
_COMPARISONS = (
    re.compile(r"""\$\{(?P<name>\w+)\}['"\s]*[!=]=\s*(['"])(?P<text>[^'"$]*)\2"""),
    re.compile(r"""(['"])(?P<text>[^'"$]*)\1\s*[!=]=['"\s]*\$\{(?P<name>\w+)\}"""),
)


def compared(condition: Any, context: LaunchContext) -> Iterator[tuple[str, str]]:
    """Yield the arguments that a condition compares with constants, and the constants."""
    for kind in ("LaunchConfigurationEquals", "LaunchConfigurationNotEquals"):
        name = getattr(condition, f"_{kind}__launch_configuration_name", None)
        if name is not None:
            yield str(name), text_of(getattr(condition, f"_{kind}__expected_value"), context)
    predicate = getattr(condition, "_predicate_expression", None)
    inner = getattr(condition, "_IfCondition__predicate_expression", None)
    inner = inner or getattr(condition, "_UnlessCondition__predicate_expression", None)
    text = _as_code(predicate or inner or [])
    for pattern in _COMPARISONS:
        for match in pattern.finditer(text):
            yield match["name"], match["text"]


def _as_code(substitutions: Iterable[Any]) -> str:
    """Return substitutions as text, with ``${name}`` for arguments."""
    return "".join(map(_piece, substitutions))


def _piece(substitution: Any) -> str:
    match substitution:
        case TextSubstitution():
            return str(substitution.text)
        case LaunchConfiguration():
            return f"${{{_as_code(substitution.variable_name)}}}"
        case PythonExpression():
            return _as_code(substitution.expression)
        case EqualsSubstitution() | NotEqualsSubstitution():
            sides = map(_as_code, (substitution.left, substitution.right))
            return " == ".join(text if "${" in text else f"'{text}'" for text in sides)
        case AndSubstitution() | OrSubstitution():
            return f"{_as_code(substitution.left)} and {_as_code(substitution.right)}"
    return _as_code(substitution.value) if isinstance(substitution, NotSubstitution) else ""


def text_of(value: Any, context: LaunchContext) -> str:
    """Return a text, a number or substitutions as a text."""
    if isinstance(value, int | float):
        return str(value)
    return str(perform_substitutions(context, normalize_to_list_of_substitutions(value or "")))
