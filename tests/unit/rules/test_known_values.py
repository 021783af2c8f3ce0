"""What code reads from lists of a known length and with the known values of parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in, quoted

SYSTEM = """\
system: a
nodes:
  n:
    behavior: code:Code
    timers: {tick: {period_ms: 100}}
    parameters:
      gains: {type: double_array, default: [1.0, 2.0]}
      limits: {type: double_array, default: [1.0, 2.0]}
      mode: {type: string, default: fast, choices: [fast, slow]}
      sections: {type: bool_array, default: [true, true, true]}
"""
CODE = """\
from enum import Enum, IntEnum, auto

import numpy as np
from composer.behavior import Behavior
from sensor_msgs.msg import Imu

FACTORS = {"fast": 2.0, "slow": 1.0}
FACTOR = {"fast": 2.0}


class Mode(Enum):
    FAST = "fast"
    SLOW = "slow"


class FastMode(Enum):
    FAST = "fast"


class Gear(Enum):
    FAST = auto()
    SLOW = auto()


class Leg(IntEnum):
    LEFT = 0
    RIGHT = 1
    MIDDLE = 2


class Code(Behavior):
    def on_configure(self):
        self.row = [1.0, 2.0]

    def third(self, message) -> int | None:
        if message:
            return 2
        return None

    def read(self, index: int) -> float:
        return self.row[index]

    def side(self, leg: Leg) -> int:
        return leg

    def on_tick(self):
        {statement}
"""


def _found(statement: str, folder: Path, imports: str = "") -> list[str]:
    code = imports + CODE.replace("{statement}", statement.replace("\n", "\n        "))
    (folder / "code.py").write_text(code, encoding="utf-8")
    return [quoted(item) for item in diagnostics_in(SYSTEM, folder)]


GUARD = "if len(self.parameters.{}) != 3:\n    raise ValueError\n"


@pytest.mark.parametrize(
    ("statement", "place"),
    [
        # the length of another parameter does not limit this one
        (GUARD.format("sections") + "a, b, c = self.parameters.gains", "self.parameters.gains"),
        (GUARD.format("sections") + "self.parameters.gains[2]", "2"),
        # an index beyond the end
        ("index = self.third(1)\nif index is not None:\n    self.row[index]", "index"),
        ("for index in (0, 1, 2):\n    self.row[index]", "index"),
        (
            "raw = np.zeros(3)\nfor at, name in ((0, 'a'), (2, 'b')):\n    raw[at + 1] = 1.0",
            "at + 1",
        ),
        ("[self.row[index] for index in range(3)]", "index"),
        ("self.row[Leg.MIDDLE]", "Leg.MIDDLE"),
        ("[self.row[leg] for leg in Leg]", "leg"),
        ("self.read(2)", "index"),
        # as many items as an enumeration has members, and as an array of numpy
        ("Imu().orientation_covariance = [1.0 for leg in Leg]", "[1.0 for leg in Leg]"),
        ("Imu().orientation_covariance = np.zeros(3).tolist()", "np.zeros(3).tolist()"),
        # a float is not a member
        ("self.side(self.clock.now())", "self.clock.now()"),
        ("Mode[self.parameters.mode]", "self.parameters.mode"),
        ("FastMode[self.parameters.mode.upper()]", "self.parameters.mode.upper()"),
        ("Gear(self.parameters.mode)", "self.parameters.mode"),
        ("Gear(3)", "3"),
        # a choice that is not a key, or not the value of a member
        ("FACTOR[self.parameters.mode]", "self.parameters.mode"),
        (
            "self.mode = FastMode(self.parameters.mode)\nif self.mode is FastMode.FAST:\n    pass",
            "self.parameters.mode",
        ),
    ],
)
def test_what_a_known_length_contradicts_is_found(
    statement: str, place: str, tmp_path: Path
) -> None:
    assert _found(statement, tmp_path) == [place]


@pytest.mark.parametrize(
    "statement",
    [
        GUARD.format("gains") + "a, b, c = self.parameters.gains",
        "self.side(Leg.LEFT), self.side(1), [self.side(leg) for leg in Leg]",
        "self.row[Leg.RIGHT], self.row[-1], self.read(1), [self.row[index] for index in range(2)]",
        "for index in (0, 1, 2):\n    if index < 2:\n        self.row[index]",
        "for index in (0, 1, 2):\n    self.row[index]\n    if index == 1:\n        break",
        "for index, name in ((0, 'a'), (2, 'b')):\n    if name == 'a':\n        self.row[index]",
        "try:\n    [self.row[index] for index in range(3)]\nexcept IndexError:\n    pass",
        "[self.row[leg] for leg in Leg if leg != Leg.MIDDLE]",
        "index = self.third(1)\nif index:\n    self.row[index]",
        "row = [1.0]\nrow.append(2.0)\nfor index in range(2):\n    row[index]",
        "Imu().orientation_covariance = np.zeros(9).tolist()",
        "FACTORS[self.parameters.mode], Mode(self.parameters.mode)",
        "if self.parameters.mode != 'slow':\n    FACTOR[self.parameters.mode]",
        "mode = self.parameters.mode\nif mode == 'fast':\n    FastMode(self.parameters.mode)",
        "Mode[self.parameters.mode.upper()], Gear(1), Gear(2), Gear[self.parameters.mode.upper()]",
        "try:\n    FastMode[self.parameters.mode.upper()]\nexcept KeyError:\n    pass",
        "try:\n    FACTOR[self.parameters.mode]\nexcept KeyError:\n    pass",
        "try:\n    FastMode(self.parameters.mode)\nexcept ValueError:\n    pass",
        "if len(self.parameters.limits) > 2:\n    self.parameters.gains[2]",  # one for each
        "for values in (self.parameters.gains,):\n"
        "    if len(values) > 2:\n        self.parameters.gains[2]",
    ],
)
def test_what_may_be_there_is_not_reported(statement: str, tmp_path: Path) -> None:
    assert _found(statement, tmp_path) == []


@pytest.mark.parametrize(
    ("statement", "places"),
    [
        # what else the value causes is never reached
        (
            "if len(self.parameters.gains) != COUNT:\n    raise ValueError\n"
            "Imu().orientation_covariance = self.parameters.gains",
            ["len(self.parameters.gains) != COUNT"],
        ),
        ("assert self.parameters.mode == 'slow', 'no'", ["self.parameters.mode == 'slow'"]),
        (
            "if not self.parameters.gains or len(self.parameters.gains) < 3:\n    raise ValueError",
            ["not self.parameters.gains or len(self.parameters.gains) < 3"],
        ),
        ("if len(self.parameters.gains) != 2:\n    raise ValueError", []),
        ("if self.name and len(self.parameters.gains) != 3:\n    raise ValueError", []),
        ("if self.name:\n    return\nif self.parameters.mode == 'fast':\n    raise KeyError", []),
        ("if self.parameters.mode == 'fast':\n    self.log.warn('fast')", []),
    ],
)
def test_values_that_on_configure_refuses(
    statement: str, places: list[str], tmp_path: Path
) -> None:
    code = "COUNT = 3\n" + CODE.replace("{statement}", "pass")
    statement = statement.replace("\n", "\n        ")
    code = code.replace("self.row = [1.0, 2.0]", f"self.row = [1.0, 2.0]\n        {statement}")
    (tmp_path / "code.py").write_text(code, encoding="utf-8")
    assert [quoted(item) for item in diagnostics_in(SYSTEM, tmp_path)] == places


def test_a_bounded_string_has_characters(tmp_path: Path) -> None:
    package = tmp_path / "interfaces" / "x_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "msg" / "Parcel.msg").write_text("string<=32 code\n", encoding="utf-8")
    (package / "package.xml").write_text(
        '<package format="3"><name>x_msgs</name></package>', encoding="utf-8"
    )
    statement = "code = Parcel().code\nprint(code[:2], code[0], len(code))"
    assert _found(statement, tmp_path, "from x_msgs.msg import Parcel\n") == []
