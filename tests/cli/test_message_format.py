"""How ``compose topic echo`` prints a message."""

from __future__ import annotations

from typing import Any

import pytest

from composer.cli.support.failure import UsageFailure
from composer.cli.support.message_format import MessageFormat

SCAN = {"frame": "laser, left", "ranges": [0.5, 1.5, 2.5], "pose": {"x": 1.0}}


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, "frame: laser, left\nranges:\n- 0.5\n- 1.5\n- 2.5\npose:\n  x: 1.0\n---"),
        ({"flow_style": True},
         "{frame: 'laser, left', ranges: [0.5, 1.5, 2.5], pose: {x: 1.0}}\n---"),
        ({"csv": True}, '"laser, left",0.5,1.5,2.5,1.0'),
        ({"json": True, "no_arr": True},
         '{"frame": "laser, left", "ranges": "<3 items>", "pose": {"x": 1.0}}'),
        ({"csv": True, "no_str": True, "no_arr": True}, "<11 characters>,<3 items>,1.0"),
        ({"flow_style": True, "truncate_length": 2},
         "{frame: la..., ranges: [0.5, 1.5, '... 3 items'], pose: {x: 1.0}}\n---"),
        ({"csv": True, "truncate_length": 2}, '"laser, left",0.5,1.5,2.5,1.0'),
        ({"flow_style": True, "truncate_length": 2, "full_length": True},
         "{frame: 'laser, left', ranges: [0.5, 1.5, 2.5], pose: {x: 1.0}}\n---"),
    ],
)  # fmt: skip
def test_a_message_is_printed_as_the_options_say(options: dict[str, Any], expected: str) -> None:
    assert MessageFormat(**options).text(SCAN) == expected


def test_a_part_of_a_message_is_printed_alone() -> None:
    assert MessageFormat(csv=True).text(7) == "7"
    assert MessageFormat(flow_style=True).text("wall") == "wall\n---"


def test_two_formats_at_once_are_refused() -> None:
    with pytest.raises(UsageFailure, match="choose one"):
        MessageFormat(json=True, csv=True)
