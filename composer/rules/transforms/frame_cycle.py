"""A cycle of frames."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.frames import cycles, frame_trees, place
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register

RULE = register(
    Rule(
        code="RC511",
        name="frame-cycle",
        severity=Severity.ERROR,
        summary="Frames are parents of each other in a cycle.",
        why=(
            "Frames form a tree. In a cycle, tf2 finds no transform, and reports that a frame is "
            "its own parent."
        ),
        bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static:
        laser: {parent: mast, translation_m: {z: 0.1}}
        mast: {parent: laser, translation_m: {z: 0.2}}
""",
        good="""\
system: rover
nodes:
  mounts:
    transforms:
      static:
        laser: {parent: mast, translation_m: {z: 0.1}}
        mast: {parent: base_link, translation_m: {z: 0.2}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report each cycle once."""
    for tree in context.once(frame_trees):
        for cycle in cycles(tree):
            first, *others = cycle
            path = " -> ".join((*(item.child for item in cycle), first.child))
            message = f"frames are parents of each other in a cycle: {path}"
            if not others:
                message = f"frame '{first.child}' is its own parent"
            span, labels = place(first.node, first.declared.parent)
            steps = tuple(
                Label(item.declared.parent.span, f"the parent of '{item.child}'") for item in others
            )
            yield Diagnostic(RULE, message, span, (*labels, *steps), "change one of the parents")
