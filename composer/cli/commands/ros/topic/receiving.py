"""What ``compose topic echo``, ``hz``, ``bw`` and ``delay`` share: time limits and a filter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.completion import complete_topic
from composer.cli.support.errors import UsageError
from composer.cli.support.options import DEFAULT_TIMEOUT_S, finite

if TYPE_CHECKING:
    from composer.language.expressions import Expression

Topic = Annotated[str, typer.Argument(metavar="TOPIC", autocompletion=complete_topic)]

Filter = Annotated[
    str | None,
    typer.Option(
        "--filter",
        metavar="EXPRESSION",
        help="Only messages for which the expression is true, such as 'message.data > 0'.",
        show_default=False,
    ),
]

#: One option for both limits. Without it, only the discovery of the topic is limited.
ReceiveTimeout = Annotated[
    float | None,
    typer.Option(
        "--timeout",
        metavar="SECONDS",
        min=0.0,
        callback=finite,
        help="Maximum time to wait for the topic, and then for each message.",
        show_default=f"{DEFAULT_TIMEOUT_S} for the topic, no limit for messages",
    ),
]


def topic_timeout_s(timeout: float | None) -> float:
    """Return the time limit for the discovery of the topic."""
    return DEFAULT_TIMEOUT_S if timeout is None else timeout


def message_timeout_s(timeout: float | None) -> float:
    """Return the time limit for each message."""
    return float("inf") if timeout is None else timeout


class MessageFilter:
    """The expression of ``--filter``. Raises UsageError if it is not valid."""

    def __init__(self, condition: str | None) -> None:
        self._condition = None if condition is None else _compiled(condition)

    @property
    def passes_all(self) -> bool:
        """Whether no expression was given."""
        return self._condition is None

    def matches(self, message: Any) -> bool:
        """Say whether the expression is true. Raises RosError if it cannot be evaluated."""
        if self._condition is None:
            return True
        from composer.client.session import RosError
        from composer.language.expressions import EvaluationError

        try:
            return bool(self._condition.evaluate({"message": message}))
        except EvaluationError as error:
            raise RosError(f"--filter: {error}") from error


def _compiled(condition: str) -> Expression:
    from composer.language.expressions import ExpressionError, compile_expression

    try:
        return compile_expression(condition)
    except ExpressionError as error:
        raise UsageError(f"--filter: {error}") from error
