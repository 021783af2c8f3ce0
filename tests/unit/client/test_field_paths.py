from __future__ import annotations

import pytest

from composer.client.messages.field_paths import path_steps


@pytest.mark.parametrize(
    ("path", "steps"),
    [
        ("data", ["data"]),
        ("pose.position.x", ["pose", "position", "x"]),
        ("transforms[0].header.frame_id", ["transforms", 0, "header", "frame_id"]),
        ("ranges[12]", ["ranges", 12]),
        ("ranges.12", ["ranges", 12]),
        ("rows[1][2].x", ["rows", 1, 2, "x"]),
    ],
)
def test_paths(path: str, steps: list[str | int]) -> None:
    assert path_steps(path) == steps


@pytest.mark.parametrize(
    "path", ["", ".", "a.", "a[", "a[]", "a[x]", "a[-1]", "[0]", "a b", "a[0", "a]0[", "a[٣]"]
)
def test_what_is_not_a_path(path: str) -> None:
    with pytest.raises(ValueError, match="is not a path of fields and indices"):
        path_steps(path)
