"""A frame that is looked up, and that nothing broadcasts."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.frames import complete_trees, cycles, place
from composer.diagnostics import Diagnostic, error, nearest

RULE = error(
    code="RC512",
    name="unknown-frame",
    summary="A node looks up a frame that no node broadcasts.",
    why=(
        "Every lookup of the frame fails. Frames of external nodes are declared as well: in "
        "the 'transforms' of the external node or executable that broadcasts them."
    ),
    bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, translation_m: {z: 0.3}}}
  viewer:
    external: true
    transforms: {lookup: [base_link, lasr]}
""",
    good="""\
system: rover
nodes:
  mounts:
    transforms:
      static: {laser: {parent: base_link, translation_m: {z: 0.3}}}
  viewer:
    external: true
    transforms: {lookup: [base_link, laser]}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the frames that nodes look up, in YAML and in behaviors."""
    for tree in complete_trees(context):
        known = frozenset(tree.frames)
        in_cycles = {item.child for cycle in cycles(tree) for item in cycle}
        for lookup in tree.lookups:
            roots = [tree.root(frame.value) for frame in lookup.frames if frame.value in known]
            has_cycle = bool(in_cycles) and all(root in in_cycles for root in roots)
            for frame in lookup.frames:
                if frame.value in known or frame.value.startswith("/"):
                    continue
                close = nearest(frame.value, tree.frames)
                is_alone = close is not None or any(other.value in known for other in lookup.frames)
                span, labels = place(lookup.node, frame, is_alone=is_alone)
                if has_cycle and close is None:
                    continue  # probably the parent that a frame of the cycle should have
                hint = "declare it in 'transforms' of the node that broadcasts it"
                if close is not None:
                    hint = f"did you mean '{close}'?"
                message = f"no node broadcasts the frame '{frame}' on {tree.topic}"
                yield Diagnostic(RULE, message, span, labels, hint)
