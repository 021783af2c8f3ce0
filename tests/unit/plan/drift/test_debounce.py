from __future__ import annotations

from dataclasses import replace

from composer.plan.drift import Debouncer, Drift, DriftChange, DriftKind

SPEED = Drift(DriftKind.WRONG_PARAMETER, "/clerk", "parameter speed", "1.0", "2.0")
GONE = Drift(DriftKind.MISSING_NODE, "/guard")
NOTHING = DriftChange((), ())


def test_a_short_difference_is_never_reported() -> None:
    debouncer = Debouncer(2.0)
    assert debouncer.update(0.0, [SPEED]) == NOTHING
    assert debouncer.update(1.9, [SPEED]) == NOTHING
    assert debouncer.update(2.5, []) == NOTHING
    assert debouncer.update(3.0, [SPEED]) == NOTHING  # counted from the beginning again
    assert debouncer.reported == ()


def test_a_lasting_difference_is_reported_once_and_again_when_resolved() -> None:
    debouncer = Debouncer(2.0)
    debouncer.update(0.0, [SPEED])
    assert debouncer.update(2.0, [SPEED, GONE]) == DriftChange((SPEED,), ())
    assert debouncer.update(3.0, [SPEED, GONE]) == NOTHING
    assert debouncer.update(4.0, [GONE]) == DriftChange((GONE,), (SPEED,))
    assert debouncer.reported == (GONE,)
    assert debouncer.update(5.0, []) == DriftChange((), (GONE,))


def test_a_reported_difference_with_another_value_is_reported_immediately() -> None:
    debouncer = Debouncer(0.0)
    faster = replace(SPEED, live="3.0")
    assert debouncer.update(0.0, [SPEED]) == DriftChange((SPEED,), ())
    assert debouncer.update(0.1, [faster]) == DriftChange((faster,), ())


def test_settled_if_all_differences_have_lasted() -> None:
    debouncer = Debouncer(1.0)
    debouncer.update(0.0, [SPEED])
    assert not debouncer.is_settled([SPEED])
    debouncer.update(1.0, [SPEED, GONE])
    assert debouncer.is_settled([SPEED])
    assert not debouncer.is_settled([SPEED, GONE])
    assert debouncer.is_settled([])
