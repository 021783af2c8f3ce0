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
from enum import Enum, IntEnum

from composer.behavior import Behavior

FACTORS = {"fast": 2.0, "slow": 1.0}
FACTOR = {"fast": 2.0}


class Mode(Enum):
    FAST = "fast"
    SLOW = "slow"


class FastMode(Enum):
    FAST = "fast"


class Leg(IntEnum):
    LEFT = 0
    RIGHT = 1


class Code(Behavior):
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
        # a float is not a member
        ("self.side(self.clock.now())", "self.clock.now()"),
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
        "FACTORS[self.parameters.mode], Mode(self.parameters.mode)",
        "if self.parameters.mode != 'slow':\n    FACTOR[self.parameters.mode]",
        "mode = self.parameters.mode\nif mode == 'fast':\n    FastMode(self.parameters.mode)",
        "try:\n    FACTOR[self.parameters.mode]\nexcept KeyError:\n    pass",
        "try:\n    FastMode(self.parameters.mode)\nexcept ValueError:\n    pass",
        "if len(self.parameters.limits) > 2:\n    self.parameters.gains[2]",  # one for each
        "for values in (self.parameters.gains,):\n"
        "    if len(values) > 2:\n        self.parameters.gains[2]",
    ],
)
def test_what_may_be_there_is_not_reported(statement: str, tmp_path: Path) -> None:
    assert _found(statement, tmp_path) == []


def test_a_bounded_string_has_characters(tmp_path: Path) -> None:
    package = tmp_path / "interfaces" / "x_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "msg" / "Parcel.msg").write_text("string<=32 code\n", encoding="utf-8")
    (package / "package.xml").write_text(
        '<package format="3"><name>x_msgs</name></package>', encoding="utf-8"
    )
    statement = "code = Parcel().code\nprint(code[:2], code[0], len(code))"
    assert _found(statement, tmp_path, "from x_msgs.msg import Parcel\n") == []
