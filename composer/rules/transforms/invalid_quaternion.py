"""A quaternion that is not a rotation."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, error
from composer.geometry import is_unit, normalized

RULE = error(
    code="RC516",
    name="invalid-quaternion",
    summary="A quaternion is not of length 1.",
    why=("Only unit quaternions are rotations. tf2 ignores transforms with others."),
    bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, quaternion: {z: 1.0, w: 1.0}}}
""",
    good="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, quaternion: {z: 0.70711, w: 0.70711}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the rotations of static transforms."""
    for node in context.system.nodes:
        for static in node.transforms.static if node.transforms is not None else ():
            if static.values is None or is_unit(static.values.value.rotation):
                continue
            rotation = static.values.value.rotation
            message = f"the quaternion of frame '{static.child}' is not of length 1"
            hint = "use 'rotation_deg' or 'rotation_rad'"
            if any(rotation):
                names = ("x", "y", "z", "w")
                unit = zip(names, normalized(rotation), strict=True)
                hint = f"write {{{', '.join(f'{name}: {value:.5g}' for name, value in unit)}}}"
            yield Diagnostic(RULE, message, static.values.span, hint=hint)
