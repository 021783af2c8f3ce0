"""The trees of frames of a system: what is broadcast, and what is looked up."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from typing import TypeAlias

from composer.base.diagnostics import Label
from composer.base.fast_dataclass import dataclass
from composer.base.graphs import cycles
from composer.base.source import Located, Span
from composer.base.spelling import vocabulary
from composer.model import (
    TF_STATIC_TOPIC,
    TF_TOPIC,
    TF_TYPE,
    DynamicTransform,
    Node,
    PortKind,
    StaticTransform,
)
from composer.python_code.lookup import BehaviorSource
from composer.python_code.scopes import Scope
from composer.python_code.syntax import scopes_in
from composer.python_code.trees import argument, dotted, span_of
from composer.rules.analysis.context import Context, behaviors, is_unresolved
from composer.rules.analysis.subjects import earlier_errors

BROADCAST = "broadcast"
_TRANSFORMS = "self.transforms"
_PARAMETER = "self.parameters."
_PAIR = ((0, "target"), (1, "source"))
#: The methods of ``self.transforms``, with the position and name of each frame they take.
_METHODS: Mapping[str, tuple[tuple[int, str], ...]] = {
    "lookup": _PAIR,
    "wait": _PAIR,
    "can_lookup": _PAIR,
    "transform": ((1, "target"),),
    BROADCAST: ((0, "child"),),
}
_STATIC_SUFFIX = "_static"
#: Maximum number of similar names to consider, because the name itself is among them.
_MAXIMUM_CANDIDATES = 5
Declared: TypeAlias = StaticTransform | DynamicTransform


@dataclass(frozen=True, slots=True)
class FrameUse:
    """A call of ``self.transforms``, with the frames whose IDs are known."""

    method: str
    span: Span
    frames: tuple[Located[str], ...]


def frame_uses(node: Node, source: BehaviorSource) -> Iterator[FrameUse]:
    """Yield the calls of ``self.transforms`` in the methods of a behavior.

    The ID of a frame is known if it is a constant or a parameter of the node.
    """
    for scope in scopes_in(source.own_classes):
        for call in scope.nodes:
            match call:
                case ast.Call(func=ast.Attribute(value=owner, attr=name)) if name in _METHODS:
                    if _dotted_name(owner, scope) == _TRANSFORMS:
                        given = (argument(call, *place) for place in _METHODS[name])
                        frames = (
                            _used_frame(item, scope, node) for item in given if item is not None
                        )
                        span = span_of(call.func, scope.source)
                        yield FrameUse(name, span, tuple(filter(None, frames)))


def _used_frame(expression: ast.expr, scope: Scope, node: Node) -> Located[str] | None:
    """Return the ID of a frame, at its place in the code."""
    name = _dotted_name(expression, scope)
    if name.startswith(_PARAMETER):
        parameter = node.parameter(name.removeprefix(_PARAMETER))
        value = parameter.value.value if parameter is not None and parameter.value else None
    else:
        value = scope.known(scope.literal, expression)
    place = span_of(expression, scope.source)
    return Located(value, place) if isinstance(value, str) else None


def _dotted_name(expression: ast.expr, scope: Scope) -> str:
    """Return the dotted name that an expression stands for; "" if there is none."""
    value = scope.known(scope.followed, expression)
    return dotted(value) if value is not None else ""


@dataclass(frozen=True, slots=True)
class Broadcast:
    """A transform that a node broadcasts."""

    node: Node
    declared: Declared

    @property
    def child(self) -> str:
        """The child frame."""
        return self.declared.child.value

    @property
    def parent(self) -> str:
        """The parent frame."""
        return self.declared.parent.value

    @property
    def kind(self) -> str:
        """``static`` or ``dynamic``."""
        return kind_of(self.declared)


@dataclass(frozen=True, slots=True)
class Lookup:
    """Frames that a node looks up together, in YAML or in its behavior."""

    node: Node
    frames: tuple[Located[str], ...]


@dataclass(slots=True)
class FrameTree:
    """All transforms on one pair of topics such as /tf and /tf_static.

    ``is_open`` is true if a node publishes there and does not declare its frames.
    """

    topic: str
    broadcasts: list[Broadcast] = field(default_factory=list)
    lookups: list[Lookup] = field(default_factory=list)
    is_open: bool = False
    by_child: dict[str, Broadcast] = field(default_factory=dict)  # the first of each
    _roots: dict[str, str] = field(default_factory=dict)

    def add(self, broadcast: Broadcast) -> None:
        """Add a transform."""
        self._roots.clear()
        self.broadcasts.append(broadcast)
        self.by_child.setdefault(broadcast.child, broadcast)

    @property
    def frames(self) -> tuple[str, ...]:
        """All frames, each once."""
        names = (name for item in self.broadcasts for name in (item.parent, item.child))
        return tuple(dict.fromkeys(names))

    def root(self, frame: str) -> str:
        """Return the frame at which the tree of ``frame`` begins; in a cycle, any of it."""
        path: dict[str, None] = {}
        while frame in self.by_child and frame not in self._roots and frame not in path:
            path[frame] = None
            frame = self.by_child[frame].parent
        root = self._roots.get(frame, frame)
        self._roots.update(dict.fromkeys(path, root))
        return root

    def roots(self) -> tuple[str, ...]:
        """Return the frames without a parent, in order."""
        return tuple(name for name in self.frames if name not in self.by_child)


def frame_trees(context: Context) -> tuple[FrameTree, ...]:
    """Return the trees of frames, one for each pair of topics."""
    trees: dict[str, FrameTree] = {}
    for node in context.system.nodes:
        for declared in node.transforms.broadcasts if node.transforms is not None else ():
            if not _is_known(declared.child, declared.parent):
                continue
            _tree(trees, topic_of(node, declared)).add(Broadcast(node, declared))
    for node, frames in _lookups(context):
        if node.transforms is not None and node.transforms.lookup is not None:
            tree = _tree(trees, _topic(node, TF_TOPIC))
            tree.lookups.append(Lookup(node, frames))
    for node in context.system.nodes:
        if node.transforms is not None and node.transforms.broadcasts:
            continue
        for port in node.ports_of(PortKind.PUBLISHER):
            if port.interface.value == TF_TYPE:
                _tree(trees, port.full_name.removesuffix(_STATIC_SUFFIX)).is_open = True
    return tuple(trees.values())


def complete_trees(context: Context) -> Iterator[FrameTree]:
    """Yield the trees whose frames are all known, so that a missing frame is an error."""
    errors = context.once(earlier_errors)
    system = context.system
    if errors.any or system.node_type or not all(node.complete for node in system.nodes):
        return
    unresolved = (
        declared
        for node in system.nodes
        for declared in (node.transforms.broadcasts if node.transforms is not None else ())
        if not _is_known(declared.child, declared.parent)
    )
    if next(unresolved, None) is None:
        yield from (tree for tree in context.once(frame_trees) if not tree.is_open)


def uses_of_behaviors(context: Context) -> tuple[tuple[Node, FrameUse], ...]:
    """Return the calls of ``self.transforms`` of all behaviors, with the node that they are for."""
    found: dict[object, tuple[FrameUse, ...]] = {}
    uses = []
    for node, source in behaviors(context):
        if not any(".transforms" in module.source.text for module in source.own_modules):
            continue
        key = (id(source), node.transforms, tuple(sorted(_texts(node).items())))
        if key not in found:
            found[key] = tuple(frame_uses(node, source))
        uses += [(node, use) for use in found[key]]
    return tuple(uses)


def kind_of(declared: Declared) -> str:
    """Return ``static`` or ``dynamic``."""
    return "static" if isinstance(declared, StaticTransform) else "dynamic"


def topic_of(node: Node, declared: Declared) -> str:
    """Return the topic of the tree of a transform: /tf, also for static ones, unless remapped."""
    is_static = isinstance(declared, StaticTransform)
    return _topic(node, TF_STATIC_TOPIC if is_static else TF_TOPIC)


def place(
    node: Node, frame: Located[str], *, is_alone: bool = False
) -> tuple[Span, tuple[Label, ...]]:
    """Return where to report something about a frame that a node uses, and further labels.

    If a node type in another file names the frame, this is the node in the system, because other
    systems may have that frame; unless ``is_alone``: the type fits the system but for this name.
    A frame in the code of a behavior is reported there.
    """
    span = frame.span
    if span.file == node.name.span.file:
        return span, ()
    if node.behavior is not None and span.file.path.endswith(".py"):
        return span, (Label(node.behavior.text.span, "the behavior of this node"),)
    if is_alone:
        return span, (Label(node.name.span, "the node that uses it"),)
    return node.name.span, (Label(span, f"frame '{frame}'"),)


def _lookups(context: Context) -> Iterator[tuple[Node, tuple[Located[str], ...]]]:
    for node in context.system.nodes:
        declared = node.transforms.lookup if node.transforms is not None else None
        if declared is not None:
            yield node, tuple(frame for frame in declared.value if _is_known(frame))
    for node, use in context.once(uses_of_behaviors):
        if use.method != BROADCAST:
            yield node, use.frames


def _topic(node: Node, declared: str) -> str:
    """Return the name of the dynamic topic of the pair that the node uses."""
    ports = node.transforms.ports if node.transforms is not None else ()
    name = next((port.full_name for port in ports if port.name.value == declared), declared)
    return name.removesuffix(_STATIC_SUFFIX)


def _tree(trees: dict[str, FrameTree], topic: str) -> FrameTree:
    return trees.setdefault(topic, FrameTree(topic))


def _is_known(*frames: Located[str]) -> bool:
    return not any(is_unresolved(frame.value) for frame in frames)


def _texts(node: Node) -> Mapping[str, str]:
    """Return the parameters that may be frames."""
    values = ((item.name.value, item.value) for item in node.parameters)
    return {
        name: value.value
        for name, value in values
        if value is not None and isinstance(value.value, str)
    }


@dataclass(frozen=True, slots=True)
class Gap:
    """Two frames that a node looks up together, each with the root of its tree."""

    node: Node
    ends: tuple[tuple[Located[str], str], tuple[Located[str], str]]


def gaps(tree: FrameTree) -> Iterator[Gap]:
    """Yield the lookups of frames in different trees; one pair for each. A cycle has no root."""
    known = frozenset(tree.frames)
    for lookup in tree.lookups:
        roots = [(frame, tree.root(frame.value)) for frame in lookup.frames if frame.value in known]
        if any(root in tree.by_child for _, root in roots):
            continue
        others = (end for end in roots if end[1] != roots[0][1])
        other = next(others, None)
        if other is not None:
            yield Gap(lookup.node, (roots[0], other))


def nearest_parent(tree: FrameTree, name: str, is_possible: Callable[[str], bool]) -> str | None:
    """Return the parent frame that ``name`` may be meant to be, or None."""
    parents = dict.fromkeys(item.parent for item in tree.broadcasts)
    close = vocabulary(tuple(parents)).close(name, _MAXIMUM_CANDIDATES)
    return next((frame for frame in close if frame != name and is_possible(frame)), None)


def frame_cycles(tree: FrameTree) -> tuple[tuple[Broadcast, ...], ...]:
    """Return each cycle of frames once: from a child to its parent, and so on."""
    graph = {
        child: (item.parent,) if item.parent in tree.by_child else ()
        for child, item in tree.by_child.items()
    }
    return tuple(tuple(tree.by_child[name] for name in names) for names in cycles(graph))
