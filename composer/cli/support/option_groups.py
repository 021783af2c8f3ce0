"""Options that several commands share, said once: each a field of a dataclass."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from typing import Any, get_type_hints

Command = Callable[..., None]


def option_group(parameter: str, group: type, prefix: str = "") -> Callable[[Command], Command]:
    """Give a command the options of ``group`` in place of its ``parameter``, which is a group.

    Each field of the dataclass is an option, with its annotation and its default; ``prefix`` comes
    before the names of all.
    """
    names = [field.name for field in fields(group)]

    def take(command: Command) -> Command:
        @wraps(command)
        def with_options(**given: Any) -> None:
            found = group(**{name: given.pop(prefix + name) for name in names})
            command(**given, **{parameter: found})

        signature = inspect.signature(command, eval_str=True)
        parameters: list[inspect.Parameter] = []
        for known in signature.parameters.values():
            parameters += _options(group, prefix) if known.name == parameter else [known]
        # It is from here that typer learns the options.
        shown = signature.replace(parameters=parameters)
        with_options.__signature__ = shown  # type: ignore[attr-defined]
        return with_options

    return take


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
