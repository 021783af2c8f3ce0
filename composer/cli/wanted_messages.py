"""Which messages of a topic are wanted, and for how long they are waited for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.failure import UsageFailure

if TYPE_CHECKING:
    from composer.expressions import Expression

Filter = Annotated[
    str | None,
    typer.Option(
        "--filter",
        metavar="EXPRESSION",
        help="Only messages for which it is true; they are called message.",
        show_default=False,
    ),
]

Silence = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="Fail when no message comes for so long.",
        show_default="wait for ever",
    ),
]


def compiled_filter(condition: str | None) -> Expression | None:
    """Return the expression; None where none is given. Raises UsageFailure."""
    if condition is None:
        return None
    from composer.expressions import ExpressionError, compile_expression

    try:
        return compile_expression(condition)
    except ExpressionError as error:
        raise UsageFailure(f"--filter: {error}") from error


def is_wanted(condition: Expression | None, message: Any) -> bool:
    """Say whether the filter lets a message through. Raises RosError where it cannot tell."""
    if condition is None:
        return True
    from composer.expressions import EvaluationError
    from composer.runtime.session import RosError

    try:
        return bool(condition.evaluate({"message": message}))
    except EvaluationError as error:
        raise RosError(f"--filter: {error}") from error
