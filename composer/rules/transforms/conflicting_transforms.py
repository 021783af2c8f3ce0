"""A frame that is broadcast more than once."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.frames import Broadcast, frame_trees, place
from composer.diagnostics import Diagnostic, Label, error

RULE = error(
    code="RC510",
    name="conflicting-transforms",
    summary="A frame has several parents, or several nodes broadcast it.",
    why=(
        "A frame has one parent and one broadcaster (REP 105). With several, tf2 uses the last "
        "message, and the frame jumps back and forth."
    ),
    bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, translation_m: {z: 0.3}}}
  calibration:
    transforms:
      static: {laser: {parent: mast, translation_m: {z: 0.1}}}
""",
    good="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {mast: {parent: base_link, translation_m: {z: 0.2}}}
  calibration:
    transforms:
      static: {laser: {parent: mast, translation_m: {z: 0.1}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report each transform of a frame after its first one."""
    for tree in context.once(frame_trees):
        for broadcast in tree.broadcasts:
            first = tree.by_child[broadcast.child]
            if first is not broadcast:
                yield _conflict(first, broadcast)


def _conflict(first: Broadcast, second: Broadcast) -> Diagnostic:
    child = second.declared.child
    message = f"frame '{child}' is broadcast by {_by(first, second)}"
    hint = "let one of them broadcast it"
    if first.parent != second.parent:
        message = f"frame '{child}' has two parents: '{first.parent}' and '{second.parent}'"
        hint = "remove one of them, or rename the frame"
    elif first.kind != second.kind:
        message = f"frame '{child}' is both static and dynamic"
    span, labels = place(second.node, child)
    own = first.declared.child.span
    other = Label(own, f"node '{first.node.name}' broadcasts it to '{first.parent}'")
    if own == span and own.file == span.file:  # two nodes of one type, or two copies
        other = Label(first.node.name.span, f"node '{first.node.name}' broadcasts it as well")
    return Diagnostic(RULE, message, span, (*labels, other), hint)


def _by(first: Broadcast, second: Broadcast) -> str:
    if first.node is second.node:
        return f"node '{first.node.name}' twice"
    return f"nodes '{first.node.name}' and '{second.node.name}'"
