from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from difflib import SequenceMatcher

import pytest

from composer.base import spelling
from composer.base.spelling import LONGEST_NAME, Vocabulary, edit_distance, is_typo

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


@pytest.mark.parametrize(
    ("names", "name", "close"),
    [
        (MANY, "camera_1234_drivr", ["camera_1234_driver"]),
        (MANY, "amera_1234_driver", ["camera_1234_driver"]),
        (MANY, "zzz", []),
        ([], "zzz", []),
        (["plan", "planner", "plane"], "planne", ["planner", "plane", "plan"]),
    ],
)
def test_the_likeliest_names_are_first(names: list[str], name: str, close: list[str]) -> None:
    assert Vocabulary(names).close(name, len(close) or 1) == close


def test_names_longer_than_any_in_ros_are_not_compared() -> None:
    longest = "abcdefghijklmnopqrstuvwxyz" * 10
    longest = longest[:LONGEST_NAME]
    assert Vocabulary([longest]).close(longest[1:]) == [longest]
    assert Vocabulary([longest + "a"]).close(longest) == []
    assert Vocabulary([longest]).close(longest + "b") == []


@pytest.mark.parametrize("letters", ["", "a" * 40, "ab" * 90])
def test_no_more_is_compared_among_many(monkeypatch: pytest.MonkeyPatch, letters: str) -> None:
    """Also of names that consist of few letters."""
    compared: Counter[str] = Counter()

    class Counted(SequenceMatcher[str]):
        def set_seqs(self, a: Sequence[str], b: Sequence[str]) -> None:
            self.words = a, b
            super().set_seqs(a, b)

        def set_seq1(self, a: Sequence[str]) -> None:
            self.words = a, self.words[1]
            super().set_seq1(a)

        def set_seq2(self, b: Sequence[str]) -> None:
            self.words = self.words[0], b
            super().set_seq2(b)

        def ratio(self) -> float:
            name, other = self.words
            compared["".join(other)] += sum(map(Counter(name).__getitem__, other))
            return super().ratio()

    monkeypatch.setattr(spelling, "SequenceMatcher", Counted)
    for count in (200, 20_000):
        names = Vocabulary(f"camera_{number}_{letters}driver" for number in range(count))
        for number in range(100):
            close = names.close(f"camera_{number}_{letters}drvier")
            assert close == ([] if len(letters) > 100 else [f"camera_{number}_{letters}driver"])
    assert max(compared.values(), default=0) <= 2 * 4000


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
