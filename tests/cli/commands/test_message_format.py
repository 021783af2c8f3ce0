"""The message formats of ``compose topic echo``."""

from __future__ import annotations

from typing import Any

import pytest

from composer.cli.commands.ros.topic.message_format import MessageFormat
from composer.cli.support.errors import UsageError

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
def test_format_options(options: dict[str, Any], expected: str) -> None:
    assert MessageFormat(**options).text(SCAN) == expected


def test_a_single_field_is_printed() -> None:
    assert MessageFormat(csv=True).text(7) == "7"
    assert MessageFormat(flow_style=True).text("wall") == "wall\n---"


def test_two_formats_are_rejected() -> None:
    with pytest.raises(UsageError, match="only one of"):
        MessageFormat(json=True, csv=True)
