"""Groups of options that several commands share, each declared as a dataclass."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from typing import Any, get_type_hints

Command = Callable[..., None]


def option_group(parameter: str, group: type, prefix: str = "") -> Callable[[Command], Command]:
    """Return a decorator that replaces ``parameter`` of a command by the options of ``group``.

    Each field of the dataclass is an option, with its annotation and its default; ``prefix`` is put
    before all names. The command receives an instance of ``group``.
    """
    names = [field.name for field in fields(group)]

    def decorate(command: Command) -> Command:
        @wraps(command)
        def with_options(**given: Any) -> None:
            instance = group(**{name: given.pop(prefix + name) for name in names})
            command(**given, **{parameter: instance})

        signature = inspect.signature(command, eval_str=True)
        parameters: list[inspect.Parameter] = []
        for known in signature.parameters.values():
            parameters += _options(group, prefix) if known.name == parameter else [known]
        # typer reads the options from the signature.
        expanded = signature.replace(parameters=parameters)
        with_options.__signature__ = expanded  # type: ignore[attr-defined]
        return with_options

    return decorate


def _options(group: type, prefix: str) -> list[inspect.Parameter]:
    annotations = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            prefix + field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=field.default,
            annotation=annotations[field.name],
        )
        for field in fields(group)
    ]
