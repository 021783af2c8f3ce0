"""Names, supervision and introspection of a node, over the settings of its system."""

from __future__ import annotations

from dataclasses import fields

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.language.tree import (
    Entry,
    Mapping,
    Tree,
    choice,
    entries,
    flag,
    integer,
    is_opaque,
    key,
    number,
    text_or_opaque,
    value_or,
)
from composer.model import (
    DEFAULT_INTROSPECTION,
    Executable,
    Introspection,
    OnFailure,
    RestartBudget,
    Supervision,
    Watch,
)
from composer.model.names import join

_INTROSPECTION = frozenset(field.name for field in fields(Introspection))


@dataclass(frozen=True, slots=True)
class NodeNames:
    """The key of a node in its system, its name in ROS if that differs, and its namespace.

    ``inner`` are the full names of further nodes of its program. ``are_kept`` is true if the
    program keeps the names of its nodes.
    """

    key: str
    namespace: Located[str]  # absolute
    own_name: Located[str] | None = None
    inner: tuple[str, ...] = ()
    are_kept: bool = False

    @property
    def ros_name(self) -> str:
        """The name in ROS, without the namespace."""
        return self.key if self.own_name is None else self.own_name.value

    @property
    def full_name(self) -> str:
        """The full name in ROS."""
        return join(self.namespace.value, self.ros_name)


def node_names(
    entry: Entry, tree: Mapping, program: Executable | None, system_namespace: Located[str]
) -> NodeNames:
    """Return the names of the node of an entry in ``nodes``."""
    namespace = _namespace(tree.get("namespace"), system_namespace)
    written = tree.get("name")
    own_name = None if written is None else text_or_opaque(written, written.span)
    listed = None if program is None else program.nodes
    are_kept = listed is not None and own_name is None
    if listed and own_name is None:
        own_name = listed[0]
    names = NodeNames(entry.name, namespace, own_name)
    inner = (join(namespace.value, item.value) for item in listed or ())
    others = tuple(name for name in inner if name != names.full_name)
    return NodeNames(entry.name, namespace, own_name, others, are_kept)


def _namespace(tree: Tree | None, system: Located[str]) -> Located[str]:
    """Return the absolute namespace of a node; a relative one is below the system's."""
    if tree is None:
        return system
    own = text_or_opaque(tree, tree.span)
    return own if is_opaque(own.value) else own.map(lambda name: join(system.value, name))


def read_supervision(lifecycle: Tree | None, default: Supervision) -> Supervision:
    """Return the supervision under ``lifecycle`` of a node or a system, over ``default``."""
    if not isinstance(lifecycle, Mapping) or not lifecycle.entries:
        return default
    return Supervision(
        timeout_ms=value_or(number(lifecycle.get("timeout_ms")), default.timeout_ms),
        on_failure=choice(lifecycle.get("on_failure"), OnFailure) or default.on_failure,
        restart=_restart(lifecycle.entry("restart"), default.restart),
        watch=_watch(lifecycle.get("watch"), default.watch),
    )


def _restart(entry: Entry | None, default: RestartBudget) -> RestartBudget:
    if entry is None or not isinstance(entry.value, Mapping):
        return default
    tree = entry.value
    backoff = tree.get("backoff_ms") or tree.get("backoff_max_ms")

    def milliseconds(name: str, fallback: float) -> float:
        return value_or(number(tree.get(name)), fallback)

    return RestartBudget(
        max_attempts=value_or(integer(tree.get("max_attempts")), default.max_attempts),
        then=value_or(choice(tree.get("then"), OnFailure), default.then),
        window_ms=milliseconds("window_ms", default.window_ms),
        backoff_ms=milliseconds("backoff_ms", default.backoff_ms),
        backoff_max_ms=milliseconds("backoff_max_ms", default.backoff_max_ms),
        span=entry.key.span,
        backoff_span=None if backoff is None else backoff.span,
        has_window=tree.get("window_ms") is not None,
    )


def _watch(tree: Tree | None, default: Watch) -> Watch:
    if not isinstance(tree, Mapping):
        return default
    silence = tree.get("topic_silence_ms")
    any_topic = number(silence)
    topics = tuple(
        (key(entry), limit)
        for entry in entries(silence)
        if (limit := number(entry.value)) is not None
    )
    is_set = silence is not None
    return Watch(
        silence_ms=any_topic if is_set else default.silence_ms,
        topics=topics if is_set else default.topics,
        callback_ms=number(tree.get("callback_ms")) or default.callback_ms,
        max_errors=integer(tree.get("max_errors")) or default.max_errors,
    )


def read_introspection(*layers: Tree | None) -> Introspection:
    """Merge ``introspection`` settings; later layers override earlier ones."""
    settings = {
        entry.name: flag(entry.value, default=True)
        for layer in layers
        for entry in entries(layer)
        if entry.name in _INTROSPECTION
    }
    return Introspection(**settings) if settings else DEFAULT_INTROSPECTION
