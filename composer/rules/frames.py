"""Frames and the trees that they form."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, nearest, warning
from composer.base.spelling import is_typo
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import listed
from composer.rules.analysis.frames import (
    Broadcast,
    FrameTree,
    Gap,
    complete_trees,
    frame_cycles,
    frame_trees,
    gaps,
    nearest_parent,
    place,
)

CONFLICTING_TRANSFORMS = error("RC510", "conflicting-transforms")
UNCONNECTED_FRAMES = error("RC512", "unconnected-frames")
SEVERAL_FRAME_TREES = warning("RC514", "several-frame-trees")
_PAIR = 2  # of trees
_MAX_SEARCHED = 20  # roots that may be misspelled
_MAX_COMPARED = 50_000  # names of frames


def check_unknown_frame(context: Context) -> Iterator[Diagnostic]:
    """Check the frames that nodes look up, in YAML and in behaviors."""
    for tree in complete_trees(context):
        known = frozenset(tree.frames)
        in_cycles = {item.child for cycle in frame_cycles(tree) for item in cycle}
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
                yield Diagnostic(UNCONNECTED_FRAMES, message, span, labels, hint)


def check_conflicting_transforms(context: Context) -> Iterator[Diagnostic]:
    """Report each transform of a frame after its first one."""
    for tree in context.once(frame_trees):
        for broadcast in tree.broadcasts:
            first = tree.by_child[broadcast.child]
            if first is not broadcast:
                yield _conflict(first, broadcast)


def _conflict(first: Broadcast, second: Broadcast) -> Diagnostic:
    child = second.declared.child
    message = f"frame '{child}' is broadcast by {_broadcasters(first, second)}"
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
    return Diagnostic(CONFLICTING_TRANSFORMS, message, span, (*labels, other), hint)


def _broadcasters(first: Broadcast, second: Broadcast) -> str:
    if first.node is second.node:
        return f"node '{first.node.name}' twice"
    return f"nodes '{first.node.name}' and '{second.node.name}'"


def check_frame_cycle(context: Context) -> Iterator[Diagnostic]:
    """Report each cycle once."""
    for tree in context.once(frame_trees):
        for cycle in frame_cycles(tree):
            first, *others = _from_the_system(cycle)
            path = " -> ".join((*(item.child for item in (first, *others)), first.child))
            message = f"frames are parents of each other in a cycle: {path}"
            if not others:
                message = f"frame '{first.child}' is its own parent"
            span, labels = place(first.node, first.declared.parent)
            steps = tuple(
                Label(item.declared.parent.span, f"the parent of '{item.child}'") for item in others
            )
            yield Diagnostic(
                CONFLICTING_TRANSFORMS,
                message,
                span,
                (*labels, *steps),
                "change one of the parents",
            )


def _from_the_system(cycle: tuple[Broadcast, ...]) -> tuple[Broadcast, ...]:
    """Return a cycle from its first transform that no node type declares, if there is one."""
    start = next((at for at, item in enumerate(cycle) if _is_of_system(item)), 0)
    return cycle[start:] + cycle[:start]


def _is_of_system(item: Broadcast) -> bool:
    return item.declared.parent.span.file == item.node.name.span.file


def check_unconnected_frames(context: Context) -> Iterator[Diagnostic]:
    """Check the frames of each lookup."""
    for tree in complete_trees(context):
        for gap in gaps(tree):
            yield _unconnected(tree, gap)


def _unconnected(tree: FrameTree, gap: Gap) -> Diagnostic:
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
    return Diagnostic(UNCONNECTED_FRAMES, message, span, (*labels, *begins), hint)


def check_several_frame_trees(context: Context) -> Iterator[Diagnostic]:
    """Report all trees together, where one of them is probably misspelled, else at the second."""
    for tree in complete_trees(context):
        if frame_cycles(tree) or len(tree.by_child) < len(tree.broadcasts):
            continue
        reported = {root for gap in gaps(tree) for _, root in gap.ends}
        roots = tree.roots()
        others = [root for root in (*roots[1:], *roots[:1]) if root not in reported]
        if len(roots) > 1 and others:
            searched = min(_MAX_SEARCHED, 1 + _MAX_COMPARED // len(tree.broadcasts))
            meant = ((root, _meant_frame(tree, root, roots)) for root in others[:searched])
            root, close = next((item for item in meant if item[1]), (others[0], None))
            yield _several_trees(tree, roots, root, close)


def _meant_frame(tree: FrameTree, root: str, roots: tuple[str, ...]) -> str | None:
    """Return the frame that ``root`` may be meant to be, or None.

    The roots of many trees, such as odom_1 and odom_2, resemble each other on purpose.
    """

    def is_possible(name: str) -> bool:
        return tree.root(name) != root and (len(roots) == _PAIR or name in tree.by_child)

    close = nearest_parent(tree, root, is_possible)
    children = (name for name in tree.by_child if is_typo(root, name) and is_possible(name))
    return close or next(children, None)


def _several_trees(
    tree: FrameTree, roots: tuple[str, ...], root: str, close: str | None
) -> Diagnostic:
    broadcast = next(item for item in tree.broadcasts if item.parent == root)
    span, labels = place(broadcast.node, broadcast.declared.parent)
    hint = f"did you mean '{close}'?" if close is not None else f"declare the parent of '{root}'"
    message = f"the frames form {len(roots)} trees, which begin at {listed(roots)}"
    return Diagnostic(SEVERAL_FRAME_TREES, message, span, labels, hint)
