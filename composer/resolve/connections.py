"""Connections, and the name and profile they give to the ports they join."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

from composer.model import ChannelKind, Connection, Delivery, Endpoint, Isolation, Port, Qos
from composer.names import join
from composer.resolve.qos import QosTable, implicit_qos
from composer.resolve.reading import choice, is_opaque, text, texts
from composer.tree import Entry, Mapping, Sequence, Tree

T = TypeVar("T")

_ENDS = {
    ChannelKind.TOPIC: ("from", "to"),
    ChannelKind.SERVICE: ("server", "clients"),
    ChannelKind.ACTION: ("server", "clients"),
}


@dataclass(frozen=True, slots=True)
class Joint:
    """What a connection gives to a port: a full name and, where it says so, a profile."""

    kind: ChannelKind
    full_name: str
    qos: Qos | None
    delivery: Delivery | None = None
    isolation: Isolation | None = None


Joints = dict[tuple[str, str], list[Joint]]


def connections(
    tree: Tree | None, namespace: str, qos: QosTable
) -> tuple[tuple[Connection, ...], Joints]:
    """Return what is declared under ``connections``, and by node and port what follows from it."""
    declared = []
    joints: Joints = {}
    for item in tree.items if isinstance(tree, Sequence) else ():
        connection = _connection(item)
        if connection is None:
            continue
        declared.append(connection)
        joint = Joint(
            connection.kind,
            full_name(connection.name.value, namespace),
            _profile(item, connection.kind, qos),
            connection.delivery.value if connection.delivery else None,
            connection.isolation.value if connection.isolation else None,
        )
        for end in (*connection.sources, *connection.sinks):
            joints.setdefault((end.node, end.port), []).append(joint)
    return tuple(declared), joints


def full_name(name: str, namespace: str) -> str:
    """Return the name a connection gives: absolute, or below the system's namespace."""
    return name if is_opaque(name) else join(namespace, name)


def joint_of(port: Port, joints: Iterable[Joint]) -> Joint | None:
    """Return the first joint of the port's kind, with what is first given to its name."""
    fitting = [joint for joint in joints if joint.kind is port.kind.channel]
    if not fitting:
        return None
    first = fitting[0]
    same = [joint for joint in fitting if joint.full_name == first.full_name]
    return Joint(
        first.kind,
        first.full_name,
        _first(joint.qos for joint in same),
        _first(joint.delivery for joint in same),
        _first(joint.isolation for joint in same),
    )


def _first(given: Iterable[T | None]) -> T | None:
    return next((value for value in given if value is not None), None)


def _connection(tree: Tree) -> Connection | None:
    if not isinstance(tree, Mapping):
        return None
    entry = _kind_entry(tree)
    name = text(entry.value) if entry is not None else None
    if entry is None or name is None:
        return None
    kind = ChannelKind(entry.name)
    sources, sinks = (_ends(tree.get(end)) for end in _ENDS[kind])
    return Connection(
        kind,
        name,
        sources,
        sinks,
        entry.key.span,
        qos=text(tree.get("qos")),
        delivery=choice(tree.get("delivery"), Delivery),
        isolation=choice(tree.get("isolation"), Isolation),
    )


def _kind_entry(tree: Mapping) -> Entry | None:
    kinds = {kind.value for kind in ChannelKind}
    return next((entry for entry in tree if entry.name in kinds), None)


def _ends(tree: Tree | None) -> tuple[Endpoint, ...]:
    return tuple(Endpoint(name) for name in texts(tree))


def _profile(tree: Tree, kind: ChannelKind, qos: QosTable) -> Qos | None:
    written = tree.get("qos") if isinstance(tree, Mapping) else None
    if written is None:
        return None
    return qos.resolve(written, implicit_qos(kind, written.span))
