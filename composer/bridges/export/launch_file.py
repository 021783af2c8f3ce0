"""A launch file that runs a system."""

from __future__ import annotations

import os
from pathlib import Path

from composer.bridges.templates import filled
from composer.model import System


def launch_file(system: System, path: Path, output: Path | None) -> str:
    """Return the launch file of a system in ``path``.

    If the launch file is written to ``output``, it names the system relative to itself.
    """
    absolute = path.resolve()
    if output is None:
        place = f"Path({str(absolute)!r})"
    else:
        relative = os.path.relpath(absolute, output.resolve().parent)
        place = f"(Path(__file__).parent / {relative!r}).resolve()"
    return filled("launch_file.py", name=system.name.value, system=place)
