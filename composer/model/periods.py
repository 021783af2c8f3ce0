"""The period of a timer, and its evaluation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from enum import StrEnum

from composer.expressions import EvaluationError, Expression
from composer.fast_dataclass import dataclass
from composer.source import Span


class PeriodUnit(StrEnum):
    """The key under which a timer's period is declared."""

    MILLISECONDS = "period_ms"
    HERTZ = "rate_hz"


class PeriodError(Exception):
    """A period that cannot be evaluated, or that no timer can have."""


@dataclass(frozen=True, slots=True)
class Period:
    """The time between two calls of a timer: a number, or an expression over ``parameters``.

    None: it is not known, since it is invalid or a load-time variable without a value.
    """

    value: float | Expression | None
    unit: PeriodUnit
    span: Span = field(compare=False)

    def evaluate(self, parameters: Mapping[str, object]) -> float:
        """Return the number in ``unit`` for the given parameter values. Raises PeriodError."""
        value: object = self.value
        if value is None:
            raise PeriodError(f"{self.unit} is not known")
        try:
            if isinstance(value, Expression):
                value = value.evaluate({"parameters": parameters})
            return float(value)  # type: ignore[arg-type]
        except (EvaluationError, OverflowError, TypeError, ValueError) as error:
            raise PeriodError(f"{self.unit} cannot be {value}: {error}") from error

    def seconds(self, parameters: Mapping[str, object]) -> float:
        """Return the period in seconds for the given parameter values.

        Raises PeriodError unless it is positive and finite.
        """
        number = self.evaluate(parameters)
        if math.isfinite(number) and number > 0.0:
            seconds = number / 1000.0 if self.unit is PeriodUnit.MILLISECONDS else 1.0 / number
            if math.isfinite(seconds) and seconds > 0.0:
                return seconds
        raise PeriodError(f"{self.unit} must be positive and finite, not {number:g}")
