"""A cycle of frames."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.frames import Broadcast, cycles, frame_trees, place
from composer.diagnostics import Diagnostic, Label, error

RULE = error(
    code="RC511",
    name="frame-cycle",
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Report each cycle once."""
    for tree in context.once(frame_trees):
        for cycle in cycles(tree):
            first, *others = _from_the_system(cycle)
            path = " -> ".join((*(item.child for item in (first, *others)), first.child))
            message = f"frames are parents of each other in a cycle: {path}"
            if not others:
                message = f"frame '{first.child}' is its own parent"
            span, labels = place(first.node, first.declared.parent)
            steps = tuple(
                Label(item.declared.parent.span, f"the parent of '{item.child}'") for item in others
            )
            yield Diagnostic(RULE, message, span, (*labels, *steps), "change one of the parents")


def _from_the_system(cycle: tuple[Broadcast, ...]) -> tuple[Broadcast, ...]:
    """Return a cycle from its first transform that no node type declares, if there is one."""
    start = next((at for at, item in enumerate(cycle) if _is_of_system(item)), 0)
    return cycle[start:] + cycle[:start]


def _is_of_system(item: Broadcast) -> bool:
    return item.declared.parent.span.file == item.node.name.span.file
