"""An angle in radians that looks like degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.diagnostics import Diagnostic, warning

_FULL_TURN = 2.0 * math.pi
_TOLERANCE = 1.001

RULE = warning(
    code="RC533",
    name="rotation-unit",
    summary="An angle in 'rotation_rad' is more than a full turn.",
    why="Such angles are usually degrees, and the frame then points somewhere else.",
    bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, rotation_rad: {yaw: 180}}}
""",
    good="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, rotation_deg: {yaw: 180}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the angles of static transforms; those of a node type once."""
    for node in context.system.nodes:
        for static in node.transforms.static if node.transforms is not None else ():
            for angle in static.angles_rad:
                if abs(angle.value) > _FULL_TURN * _TOLERANCE:
                    yield Diagnostic(
                        RULE,
                        f"{number(angle.value)} rad is more than a full turn",
                        angle.span,
                        hint="write degrees in 'rotation_deg'",
                    )
