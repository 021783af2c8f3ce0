"""Frames that are looked up together, but are in different trees."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.frames import FrameTree, Gap, complete_trees, gaps, nearest_parent, place
from composer.diagnostics import Diagnostic, Label, error

RULE = error(
    code="RC513",
    name="unconnected-frames",
    summary="A node looks up frames that no chain of transforms connects.",
    why=(
        "There is a transform between two frames only if they have a common ancestor. Every "
        "lookup between these frames fails."
    ),
    bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static:
        laser: {parent: base_link, translation_m: {z: 0.3}}
        camera: {parent: base, translation_m: {x: 0.1}}
  viewer:
    external: true
    transforms: {lookup: [laser, camera]}
""",
    good="""\
system: rover
nodes:
  mounts:
    transforms:
      static:
        laser: {parent: base_link, translation_m: {z: 0.3}}
        camera: {parent: base_link, translation_m: {x: 0.1}}
  viewer:
    external: true
    transforms: {lookup: [laser, camera]}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the frames of each lookup."""
    for tree in complete_trees(context):
        for gap in gaps(tree):
            yield _diagnostic(tree, gap)


def _diagnostic(tree: FrameTree, gap: Gap) -> Diagnostic:
    (first, first_root), (second, root) = gap.ends
    span, labels = place(gap.node, second)
    message = (
        f"frames '{first}' and '{second}' are not connected: their trees begin at "
        f"'{first_root}' and '{root}'"
    )
    begin = next(item.declared.parent for item in tree.broadcasts if item.parent == root)
    begins = (Label(begin.span, "one tree begins here"),)
    close = nearest_parent(tree, root, lambda name: tree.root(name) == first_root)
    hint = f"did you mean '{close}' instead of '{root}'?" if close is not None else None
    return Diagnostic(RULE, message, span, (*labels, *begins), hint)
