"""Paths to fields of messages: ``pose.position.x``, ``transforms[0].header.frame_id``.

Commands check them before they need ROS.
"""

from __future__ import annotations

import re

_STEP = re.compile(r"(?P<name>\w+)(?P<indices>(?:\[\d+\])*)", re.ASCII)


def path_steps(path: str) -> list[str | int]:
    """Return the field names and indices of a path; ``ranges.3`` is the same as ``ranges[3]``.

    Raises ValueError if it is not a path.
    """
    steps: list[str | int] = []
    for part in path.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise ValueError(
                f"'{path}' is not a path of fields and indices, such as transforms[0].header.stamp"
            )
        name = match["name"]
        steps.append(int(name) if name.isdigit() else name)
        steps += map(int, re.findall(r"\d+", match["indices"]))
    return steps
