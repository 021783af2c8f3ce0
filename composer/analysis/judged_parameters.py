"""Which values of parameters are there to be judged."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_opaque
from composer.analysis.parameter_values import KNOWN_TYPES, type_problem
from composer.model import Parameter
from composer.source import Located
from composer.tree import Plain


def judged_values(context: Context) -> Iterator[tuple[Parameter, Located[Plain]]]:
    """Yield every default and every given value, where the type of the parameter is known."""
    for node in context.system.nodes:
        for parameter in node.parameters:
            if parameter.type.value not in KNOWN_TYPES:
                continue
            for value in _values(parameter):
                if not _holds_opaque(value.value):
                    yield parameter, value


def typed_values(context: Context) -> Iterator[tuple[Parameter, Located[Plain]]]:
    """Yield those of them that are of the parameter's type."""
    for parameter, value in judged_values(context):
        if type_problem(value.value, parameter.type.value) is None:
            yield parameter, value


def _values(parameter: Parameter) -> Iterator[Located[Plain]]:
    if parameter.default is not None:
        yield parameter.default
    if parameter.value is not None and parameter.value is not parameter.default:
        yield parameter.value


def _holds_opaque(value: Plain) -> bool:
    items = value if isinstance(value, list) else [value]
    return any(isinstance(item, str) and is_opaque(item) for item in items)
