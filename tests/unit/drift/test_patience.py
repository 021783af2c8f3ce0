from __future__ import annotations

from dataclasses import replace

from composer.drift import Change, Drift, DriftKind, Patience

SPEED = Drift(DriftKind.WRONG_PARAMETER, "/clerk", "parameter speed", "1.0", "2.0")
GONE = Drift(DriftKind.MISSING_NODE, "/guard")
NOTHING = Change((), ())


def test_what_does_not_last_is_never_told() -> None:
    patience = Patience(2.0)
    assert patience.update(0.0, [SPEED]) == NOTHING
    assert patience.update(1.9, [SPEED]) == NOTHING
    assert patience.update(2.5, []) == NOTHING
    assert patience.update(3.0, [SPEED]) == NOTHING  # counted from the beginning again
    assert patience.told == ()


def test_what_lasts_is_told_once_and_again_when_it_is_gone() -> None:
    patience = Patience(2.0)
    patience.update(0.0, [SPEED])
    assert patience.update(2.0, [SPEED, GONE]) == Change((SPEED,), ())
    assert patience.update(3.0, [SPEED, GONE]) == NOTHING
    assert patience.update(4.0, [GONE]) == Change((GONE,), (SPEED,))
    assert patience.told == (GONE,)
    assert patience.update(5.0, []) == Change((), (GONE,))


def test_a_told_difference_with_another_value_is_told_at_once() -> None:
    patience = Patience(0.0)
    faster = replace(SPEED, live="3.0")
    assert patience.update(0.0, [SPEED]) == Change((SPEED,), ())
    assert patience.update(0.1, [faster]) == Change((faster,), ())


def test_settled_is_when_all_that_was_seen_has_lasted() -> None:
    patience = Patience(1.0)
    patience.update(0.0, [SPEED])
    assert not patience.is_settled([SPEED])
    patience.update(1.0, [SPEED, GONE])
    assert patience.is_settled([SPEED])
    assert not patience.is_settled([SPEED, GONE])
    assert patience.is_settled([])
