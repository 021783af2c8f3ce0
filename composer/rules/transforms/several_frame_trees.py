"""Frames that form more than one tree."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import listed
from composer.analysis.frames import FrameTree, complete_trees, cycles, gaps, nearest_parent, place
from composer.diagnostics import Diagnostic, warning
from composer.spelling import is_typo

_PAIR = 2  # of trees

RULE = warning(
    code="RC514",
    name="several-frame-trees",
    summary="The frames of the system form several trees.",
    why=(
        "There is no transform between frames of different trees. Often the name of a parent "
        "is misspelled, or a transform is missing. Robots that share nothing can have topics "
        "of their own: remap /tf and /tf_static."
    ),
    bad="""\
system: rover
nodes:
  mounts:
    transforms:
      static:
        laser: {parent: base_link, translation_m: {z: 0.3}}
        camera: {parent: base_lnk, translation_m: {x: 0.1}}
""",
    good="""\
system: rover
nodes:
  mounts:
    transforms:
      static:
        laser: {parent: base_link, translation_m: {z: 0.3}}
        camera: {parent: base_link, translation_m: {x: 0.1}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report all trees together, where one of them is probably misspelled, else at the second."""
    for tree in complete_trees(context):
        if any(cycles(tree)) or len(tree.by_child) < len(tree.broadcasts):
            continue
        reported = {root for gap in gaps(tree) for _, root in gap.ends}
        roots = tree.roots()
        others = [root for root in (*roots[1:], *roots[:1]) if root not in reported]
        if len(roots) > 1 and others:
            meant = ((root, _meant(tree, root, roots)) for root in others)
            root, close = next((item for item in meant if item[1]), (others[0], None))
            yield _diagnostic(tree, roots, root, close)


def _meant(tree: FrameTree, root: str, roots: tuple[str, ...]) -> str | None:
    """Return the frame that ``root`` may be meant to be, or None.

    The roots of many trees, such as odom_1 and odom_2, resemble each other on purpose.
    """

    def is_possible(name: str) -> bool:
        return tree.root(name) != root and (len(roots) == _PAIR or name in tree.by_child)

    close = nearest_parent(tree, root, is_possible)
    children = (name for name in tree.by_child if is_possible(name) and is_typo(root, name))
    return close or next(children, None)


def _diagnostic(
    tree: FrameTree, roots: tuple[str, ...], root: str, close: str | None
) -> Diagnostic:
    broadcast = next(item for item in tree.broadcasts if item.parent == root)
    span, labels = place(broadcast.node, broadcast.declared.parent)
    hint = f"did you mean '{close}'?" if close is not None else f"declare the parent of '{root}'"
    message = f"the frames form {len(roots)} trees, which begin at {listed(roots)}"
    return Diagnostic(RULE, message, span, labels, hint)
