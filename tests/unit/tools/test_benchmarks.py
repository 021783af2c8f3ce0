"""Statistics, tables and charts of the benchmarks, without measurements."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from benchmarks import live_commands, targets
from benchmarks.figures import Row, Spread, as_json, percentile, ratios, spread, table
from benchmarks.plot import chart
from tests.cli.compose import compose


def row(
    values: tuple[float | None, ...] = (1.0, 3.0, 2.0),
    baseline_values: tuple[float | None, ...] = (10.0, 10.0, 10.0),
) -> Row:
    return Row("chain, N=3", "us", "rclpy", values, baseline_values)


def test_spread_is_median_and_range_without_failures() -> None:
    assert spread([5.0, 1.0, 2.0]) == Spread(median=2.0, lowest=1.0, highest=5.0, rounds=3)
    assert spread([None, 4.0, None]) == Spread(4.0, 4.0, 4.0, rounds=1)
    assert spread([None, None]) is None


def test_ratios_are_computed_per_round_without_failures() -> None:
    # The machine was ten times slower in the second round.
    assert ratios(row(values=(1.0, 10.0), baseline_values=(2.0, 20.0))) == [0.5, 0.5]
    assert ratios(row(values=(1.0, None, 3.0), baseline_values=(None, 2.0, 6.0))) == [0.5]
    with pytest.raises(ValueError, match="argument 2 is longer"):
        ratios(row(values=(1.0,), baseline_values=(1.0, 2.0)))


@pytest.mark.parametrize(
    ("share", "expected"), [(0.01, 1.0), (0.5, 50.0), (0.99, 99.0), (0.995, 100.0), (1.0, 100.0)]
)
def test_percentile_uses_the_nearest_rank(share: float, expected: float) -> None:
    assert percentile([float(value) for value in range(100, 0, -1)], share) == expected
    assert percentile([7.0], share) == 7.0


@pytest.mark.parametrize(("values", "share"), [([], 0.5), ([1.0], 0.0), ([1.0], 1.1)])
def test_percentile_rejects_invalid_arguments(values: list[float], share: float) -> None:
    with pytest.raises(ValueError, match=r"no values|share must be"):
        percentile(values, share)


def test_table_shows_medians_ratios_their_spread_and_failures() -> None:
    assert table([row()]) == (
        "case        unit  composer  baseline  value  ratio  min - max  rounds\n"
        "chain, N=3  us           2  rclpy        10    0.2  0.1 - 0.3  3 of 3"
    )
    last = table([row(baseline_values=(None, None, None))]).splitlines()[-1]
    assert last.split()[2:] == ["us", "2", "rclpy", "failed", "-", "-", "0", "of", "3"]


def test_json_contains_all_values() -> None:
    assert as_json([row(baseline_values=(10.0, None, 4.0))]) == [
        {
            "case": "chain, N=3",
            "unit": "us",
            "baseline": "rclpy",
            "values": [1.0, 3.0, 2.0],
            "baseline_values": [10.0, None, 4.0],
            "ratios": [0.1, 0.5],
        }
    ]


def test_the_chart_has_a_bar_per_ratio_and_none_for_failures() -> None:
    failed = Row("a <b>", "us", "rclpy", (1.0,), (None,))
    svg = ElementTree.fromstring(chart([row(), failed, row()]))
    bars = svg.findall("{*}rect")[1:]  # the first is the background
    assert len(bars) == 2
    assert "chain, N=3, us, baseline rclpy: 0.2" in [item.text for item in svg.iter()]


@pytest.mark.parametrize("words", live_commands.COMMANDS)
def test_measured_commands_exist(words: str) -> None:
    assert compose(*words.split(), "--help").code == 0


def test_targets_are_compared_with_measurements() -> None:
    (target,) = [target for target in targets.TARGETS if target.case == "pipeline.yaml"]
    reached = Row(target.case, target.unit, target.baseline, (1.0,), (10.0,))
    missed = Row(target.case, target.unit, target.baseline, (1.0,), (1.0,))
    unknown = Row(target.case, target.unit, target.baseline, (1.0,), (None,))
    assert targets.table([reached]).endswith("0.25       0.1  0.1 - 0.1  reached")
    assert targets.table([missed]).endswith("MISSED")
    assert targets.table([unknown]).endswith("not measured")
    assert targets.table([row()]) == ""
