from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

import pytest

from composer.base import spelling
from composer.base.spelling import LONGEST_NAME, Vocabulary, edit_distance, is_typo, vocabulary

MANY = [f"camera_{number}_driver" for number in range(3000)]


@pytest.mark.parametrize("others", [[], MANY], ids=["few", "many"])
@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("planer", "planner"),
        ("plannre", "planner"),
        ("Planner", "planner"),
        ("lanner", "planner"),
        ("motor_contoller", "motor_controller"),
        ("motorcontroller", "motor_controller"),
        ("xotor_controller", "motor_controller"),
    ],
)
def test_a_slip_is_seen_through_among_few_names_and_among_many(
    others: list[str], name: str, meant: str
) -> None:
    assert Vocabulary(["planner", "motor_controller", *others]).close(name) == [meant]


def test_numbered_names_differ_by_their_numbers() -> None:
    assert Vocabulary(MANY).close("camera_1234_drivr") == ["camera_1234_driver"]
    assert Vocabulary(MANY).close("amera_1234_driver") == ["camera_1234_driver"]


def test_what_is_like_nothing_gets_no_answer() -> None:
    assert Vocabulary(MANY).close("zzz") == []
    assert Vocabulary([]).close("zzz") == []


def test_several_are_given_with_the_likeliest_first() -> None:
    assert Vocabulary(["plan", "planner", "plane"]).close("planne", 3) == [
        "planner",
        "plane",
        "plan",
    ]


def test_the_same_names_are_sorted_once() -> None:
    assert vocabulary(("b", "a")) is vocabulary(("b", "a"))
    assert vocabulary(("b", "a")).names == ("a", "b")


def test_names_longer_than_any_in_ros_are_not_compared() -> None:
    longest = "a" * LONGEST_NAME
    assert Vocabulary([longest]).close(longest[1:]) == [longest]
    assert Vocabulary([longest + "a"]).close(longest) == []
    assert Vocabulary([longest]).close(longest + "b") == []


def test_no_more_names_are_compared_among_many(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[int] = []

    def counted(word: str, candidates: Sequence[str], *limits: Any) -> list[str]:
        compared.append(len(candidates))
        return get_close_matches(word, candidates, *limits)

    monkeypatch.setattr(spelling, "get_close_matches", counted)
    for count in (200, 20_000):
        names = Vocabulary(f"camera_{number}_driver" for number in range(count))
        for number in range(100):
            assert names.close(f"camera_{number}_drvier") == [f"camera_{number}_driver"]
    assert len(compared) == 200
    assert max(compared[100:]) <= max(compared[:100]) < 60


@pytest.mark.parametrize(
    ("name", "other", "expected"),
    [
        ("base_lnk", "base_link", True),
        ("baselink", "base_link", True),
        ("bsae_link", "base_link", True),
        ("bose_link", "base_link", True),
        ("base_link", "base_link2", False),
        ("odom_1", "odom_2", False),
        ("camera_l", "camera_r", False),
        ("fl_wheel", "fr_wheel", False),
        ("laser", "lasers", False),
        ("map", "mop", False),
        ("base_link", "base_footprint", False),
    ],
)
def test_one_wrong_letter_of_a_longer_word_is_a_typo(name: str, other: str, expected: bool) -> None:
    assert is_typo(name, other) is expected


@pytest.mark.parametrize(
    ("name", "other", "distance"),
    [("numpy", "numpy", 0), ("nmpy", "numpy", 1), ("nupmy", "numpy", 1), ("moter", "meta", 3)],
)
def test_edit_distance(name: str, other: str, distance: int) -> None:
    assert edit_distance(name, other) == edit_distance(other, name) == distance
