from __future__ import annotations

import pytest

from composer.base.source import SourceFile, Span
from composer.language.expressions import compile_expression
from composer.model import Period, PeriodError, PeriodUnit

SPAN = Span(SourceFile("system.yaml", ""), 1, 1)


@pytest.mark.parametrize(
    ("value", "unit", "period_s"),
    [
        (20.0, PeriodUnit.MILLISECONDS, 0.02),
        (20.0, PeriodUnit.HERTZ, 0.05),
        (compile_expression("parameters.rate * 2"), PeriodUnit.HERTZ, 0.1),
    ],
)
def test_period_in_seconds(value: float, unit: PeriodUnit, period_s: float) -> None:
    assert Period(value, unit, SPAN).seconds({"rate": 5}) == pytest.approx(period_s)


@pytest.mark.parametrize("unit", list(PeriodUnit))
@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_period_must_be_positive_and_finite(value: float, unit: PeriodUnit) -> None:
    with pytest.raises(PeriodError, match="must be positive and finite, not"):
        Period(value, unit, SPAN).seconds({})


def test_expression_that_cannot_be_evaluated() -> None:
    period = Period(compile_expression("1 / parameters.rate"), PeriodUnit.MILLISECONDS, SPAN)
    with pytest.raises(PeriodError, match="period_ms cannot be"):
        period.seconds({"rate": 0})
