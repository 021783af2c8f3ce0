"""Pixels of sensor_msgs/Image as RGBA, made smaller by leaving out rows and columns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[Any]

#: Bytes of a pixel, and where its red, green and blue are.
_COLORS = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "8UC3": (3, (2, 1, 0)),
    "8UC4": (4, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
    "8UC1": (1, (0, 0, 0)),
}
#: Types of a pixel of one channel, whose values are spread from black to white.
_DEPTHS = {"mono16": "u2", "16UC1": "u2", "16SC1": "i2", "32SC1": "i4", "32FC1": "f4"}
#: Rows and columns of the red, green and blue pixel in each square of a color filter.
_BAYER = {
    "bayer_rggb8": ((0, 0), (0, 1), (1, 1)),
    "bayer_bggr8": ((1, 1), (0, 1), (0, 0)),
    "bayer_gbrg8": ((1, 0), (0, 0), (0, 1)),
    "bayer_grbg8": ((0, 1), (0, 0), (1, 0)),
}


class UnsupportedImageError(Exception):
    """The encoding is not supported, or the data do not fit the size."""


def to_rgba(message: Any, max_width: int) -> tuple[int, int, bytes]:
    """Return width, height and RGBA bytes of an image of at most ``max_width`` columns.

    Raises UnsupportedImageError.
    """
    encoding = str(message.encoding)
    data = np.frombuffer(message.data, dtype=np.uint8)
    every = max(1, -(-int(message.width) // max_width))
    if encoding in _COLORS:
        size, order = _COLORS[encoding]
        colors = _rows(message, data, size)[::every, ::every][:, :, order]
    elif encoding in _DEPTHS:
        colors = _spread(_depths(message, data, _DEPTHS[encoding])[::every, ::every])
    elif encoding in _BAYER:
        colors = _from_bayer(_rows(message, data, 1)[:, :, 0], encoding, every)
    else:
        known = ", ".join((*_COLORS, *_DEPTHS, *_BAYER))
        raise UnsupportedImageError(f"encoding '{encoding:.40}' is not one of {known}")
    height, width = colors.shape[:2]
    rgba = np.full((height, width, 4), 255, dtype=np.uint8)
    rgba[:, :, :3] = colors
    return width, height, rgba.tobytes()


def _rows(message: Any, data: Pixels, size: int) -> Pixels:
    """Return the bytes of an image by row, column and channel."""
    width, height, step = int(message.width), int(message.height), int(message.step)
    if not width or not height or step < width * size or len(data) < step * height:
        raise UnsupportedImageError(
            f"{len(data)} bytes in rows of {step} do not fit {width} x {height} pixels of"
            f" '{message.encoding:.40}'"
        )
    rows = data[: step * height].reshape(height, step)[:, : width * size]
    return rows.reshape(height, width, size)


def _depths(message: Any, data: Pixels, kind: str) -> Pixels:
    order = ">" if message.is_bigendian else "<"
    size = np.dtype(kind).itemsize
    rows = np.ascontiguousarray(_rows(message, data, size))
    return rows.view(f"{order}{kind}")[:, :, 0]


def _spread(values: Pixels) -> Pixels:
    """Return gray values from the smallest to the largest finite one."""
    finite = np.isfinite(values)
    known = values[finite].astype(np.float64)
    low, high = (known.min(), known.max()) if known.size else (0.0, 0.0)
    scale = 255.0 / (high - low) if high > low else 0.0
    gray = np.zeros(values.shape, dtype=np.uint8)
    gray[finite] = ((known - low) * scale).astype(np.uint8)
    return np.repeat(gray[:, :, None], 3, axis=2)


def _from_bayer(values: Pixels, encoding: str, every: int) -> Pixels:
    """Return one pixel for each square of four, or for every n-th of them."""
    rows, columns = values.shape[0] // 2 * 2, values.shape[1] // 2 * 2
    skip = max(2, every // 2 * 2)
    channels = [values[row:rows:skip, column:columns:skip] for row, column in _BAYER[encoding]]
    return np.stack(channels, axis=2)
