"""Images become RGBA of the requested size, or an error with a reason."""

from __future__ import annotations

from array import array
from types import SimpleNamespace
from typing import Any

import pytest

np = pytest.importorskip("numpy", reason="comes with ROS")
pixels = pytest.importorskip("composer.dashboard.observing.pixels")


def image(encoding: str, width: int, height: int, data: bytes, step: int = 0) -> Any:
    return SimpleNamespace(
        encoding=encoding,
        width=width,
        height=height,
        step=step or len(data) // height,
        is_bigendian=0,
        data=array("B", data),
    )


@pytest.mark.parametrize(
    ("encoding", "data", "expected"),
    [
        ("rgb8", [1, 2, 3, 4, 5, 6], [1, 2, 3, 255, 4, 5, 6, 255]),
        ("bgr8", [1, 2, 3, 4, 5, 6], [3, 2, 1, 255, 6, 5, 4, 255]),
        ("rgba8", [1, 2, 3, 9, 4, 5, 6, 9], [1, 2, 3, 255, 4, 5, 6, 255]),
        ("mono8", [7, 8], [7, 7, 7, 255, 8, 8, 8, 255]),
        ("mono16", [0, 0, 0, 1], [0, 0, 0, 255, 255, 255, 255, 255]),
    ],
)
def test_encodings(encoding: str, data: list[int], expected: list[int]) -> None:
    assert pixels.to_rgba(image(encoding, 2, 1, bytes(data)), 100) == (2, 1, bytes(expected))


def test_depths_are_spread_nan_is_black_and_colors_are_filtered() -> None:
    depths = np.array([1.0, 3.0, np.nan, np.inf], dtype="<f4").tobytes()
    _, _, rgba = pixels.to_rgba(image("32FC1", 4, 1, depths), 100)
    assert list(rgba[::4]) == [0, 255, 0, 0]
    colors = bytes([10, 20, 30, 40])  # RG over GB
    filtered = pixels.to_rgba(image("bayer_rggb8", 2, 2, colors), 100)
    assert filtered == (1, 1, bytes([10, 20, 40, 255]))


def test_large_images_become_smaller_and_padding_is_left_out() -> None:
    row = bytes(range(200)) + bytes(56)
    width, height, rgba = pixels.to_rgba(image("mono8", 200, 10, row * 10), 64)
    assert (width, height) == (50, 3)
    assert list(rgba[:16:4]) == [0, 4, 8, 12]


@pytest.mark.parametrize(
    ("encoding", "width", "height", "data", "step"),
    [
        ("yuv422", 2, 2, bytes(8), 4),
        ("rgb8", 1000, 1000, bytes(10), 3000),
        ("rgb8", 10, 1, bytes(30), 1),
        ("rgb8", 0, 0, b"", 0),
        ("\x1b[31m" * 100, 1, 1, b"x", 1),
    ],
)
def test_an_invalid_image_says_why(
    encoding: str, width: int, height: int, data: bytes, step: int
) -> None:
    with pytest.raises(pixels.UnsupportedImageError) as caught:
        pixels.to_rgba(image(encoding, width, max(height, 1), data, step), 100)
    assert len(str(caught.value)) < 300
