"""What the benchmarks make of measurements; the measuring itself is not tested."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from benchmarks import targets
from benchmarks.figures import Row, Spread, as_json, percentile, ratios, spread, table
from benchmarks.plot import picture


def row(
    ours: tuple[float | None, ...] = (1.0, 3.0, 2.0),
    theirs: tuple[float | None, ...] = (10.0, 10.0, 10.0),
) -> Row:
    return Row("chain, N=3", "us", "somebody", ours, theirs)


def test_spread_is_the_middle_and_the_ends() -> None:
    assert spread([5.0, 1.0, 2.0]) == Spread(median=2.0, lowest=1.0, highest=5.0, rounds=3)


def test_spread_leaves_out_what_failed() -> None:
    assert spread([None, 4.0, None]) == Spread(4.0, 4.0, 4.0, rounds=1)
    assert spread([None, None]) is None


def test_a_ratio_is_made_within_its_round() -> None:
    # Round two ran on a machine ten times slower, for both.
    assert ratios(row(ours=(1.0, 10.0), theirs=(2.0, 20.0))) == [0.5, 0.5]


def test_a_round_in_which_one_failed_has_no_ratio() -> None:
    assert ratios(row(ours=(1.0, None, 3.0), theirs=(None, 2.0, 6.0))) == [0.5]


def test_rounds_of_different_number_are_a_mistake() -> None:
    with pytest.raises(ValueError, match="argument 2 is longer"):
        ratios(row(ours=(1.0,), theirs=(1.0, 2.0)))


@pytest.mark.parametrize(
    ("share", "expected"), [(0.01, 1.0), (0.5, 50.0), (0.99, 99.0), (0.995, 100.0), (1.0, 100.0)]
)
def test_percentile_is_the_nearest_rank(share: float, expected: float) -> None:
    assert percentile([float(value) for value in range(100, 0, -1)], share) == expected


def test_percentile_of_one_value_is_that_value() -> None:
    assert percentile([7.0], 0.01) == percentile([7.0], 1.0) == 7.0


@pytest.mark.parametrize(("values", "share"), [([], 0.5), ([1.0], 0.0), ([1.0], 1.1)])
def test_percentile_refuses_what_has_none(values: list[float], share: float) -> None:
    with pytest.raises(ValueError, match=r"no values|not a share"):
        percentile(values, share)


def test_table_shows_medians_ratios_and_their_spread() -> None:
    assert table([row()]) == (
        "case        unit  ours  against   theirs  ratio  least - most  rounds\n"
        "chain, N=3  us       2  somebody      10    0.2     0.1 - 0.3  3 of 3"
    )


def test_table_says_what_failed_and_invents_nothing() -> None:
    last = table([row(theirs=(None, None, None))]).splitlines()[-1]
    assert last.split()[2:] == ["us", "2", "somebody", "failed", "-", "-", "0", "of", "3"]


def test_json_keeps_every_figure() -> None:
    assert as_json([row(theirs=(10.0, None, 4.0))]) == [
        {
            "case": "chain, N=3",
            "unit": "us",
            "against": "somebody",
            "ours": [1.0, 3.0, 2.0],
            "theirs": [10.0, None, 4.0],
            "ratios": [0.1, 0.5],
        }
    ]


def test_the_picture_has_a_bar_for_each_ratio_and_none_for_what_failed() -> None:
    failed = Row("a <b>", "us", "somebody", (1.0,), (None,))
    drawn = ElementTree.fromstring(picture([row(), failed, row()]))
    bars = drawn.findall("{*}rect")[1:]  # the first is the background
    assert len(bars) == 2
    assert "chain, N=3, us, against somebody: 0.2" in [item.text for item in drawn.iter()]


def test_targets_are_held_against_what_was_measured() -> None:
    (found,) = [target for target in targets.TARGETS if target.case == "pipeline.yaml"]
    reached = Row(found.case, found.unit, found.against, (1.0,), (10.0,))
    missed = Row(found.case, found.unit, found.against, (1.0,), (1.0,))
    unknown = Row(found.case, found.unit, found.against, (1.0,), (None,))
    assert targets.table([reached]).endswith("0.25       0.1     0.1 - 0.1  reached")
    assert targets.table([missed]).endswith("MISSED")
    assert targets.table([unknown]).endswith("not measured")
    assert targets.table([row()]) == ""
