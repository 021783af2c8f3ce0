"""Which messages of a topic are wanted, and for how long they are waited for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.failure import UsageFailure
from composer.cli.support.finite import finite
from composer.cli.support.ros import DEFAULT_TIMEOUT_S

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

#: Who says how long, says it of both; who does not, may start before what is slow to come.
Patience = Annotated[
    float | None,
    typer.Option(
        "--timeout",
        metavar="SECONDS",
        min=0.0,
        callback=finite,
        help="How long to wait for the topic, and then for each message.",
        show_default=f"{DEFAULT_TIMEOUT_S} for the topic, for ever for messages",
    ),
]


def topic_timeout_s(timeout: float | None) -> float:
    """Return how long the topic itself is waited for."""
    return DEFAULT_TIMEOUT_S if timeout is None else timeout


def message_timeout_s(timeout: float | None) -> float:
    """Return how long each message is waited for."""
    return float("inf") if timeout is None else timeout


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
    from composer.remote.session import RosError

    try:
        return bool(condition.evaluate({"message": message}))
    except EvaluationError as error:
        raise RosError(f"--filter: {error}") from error
