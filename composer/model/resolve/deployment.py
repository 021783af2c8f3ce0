"""Read how a system is deployed: its processes, hosts, discovery, and what it records."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Map

from composer.base.source import Located
from composer.language.tree import Entry, Mapping, Tree
from composer.language.tree_values import (
    choice,
    entries,
    environment,
    flag,
    integer,
    integers,
    key,
    mapping,
    number,
    text,
    texts,
    value_or,
)
from composer.model import Host, Process
from composer.model.discovery import DEFAULT_SERVER_PORT, Discovery, DiscoveryKind
from composer.model.recording import Recording


def read_processes(tree: Tree | None) -> tuple[Process, ...]:
    """Return the processes."""
    return tuple(_process(entry) for entry in entries(tree))


def processes_of_nodes(processes: Iterable[Process]) -> Map[str, Located[str]]:
    """Return the process of each node that a process names; the first one that does."""
    found: dict[str, Located[str]] = {}
    for process in processes:
        for node in process.nodes:
            found.setdefault(node.value, process.name)
    return found


def _process(entry: Entry) -> Process:
    tree = mapping(entry)
    return Process(
        name=key(entry),
        span=entry.key.span,
        nodes=texts(tree.get("nodes")),
        cpus=integers(tree.get("cpus")),
        priority=value_or(integer(tree.get("priority")), None),
        environment=environment(tree.get("environment")),
        memory_mb=number(tree.get("memory_mb")),
        host=text(tree.get("host")),
    )


def read_hosts(tree: Tree | None) -> tuple[Host, ...]:
    """Return the hosts."""
    return tuple(_host(entry) for entry in entries(tree))


def _host(entry: Entry) -> Host:
    tree = mapping(entry)
    return Host(
        name=key(entry),
        span=entry.key.span,
        address=text(tree.get("address")) or key(entry),
        port=value_or(integer(tree.get("port")), None),
        user=text(tree.get("user")),
        workspace=text(tree.get("workspace")),
        python=value_or(text(tree.get("python")), None),
        setup=tuple(item.value for item in texts(tree.get("setup"))),
        environment=environment(tree.get("environment")),
        identity_file=value_or(text(tree.get("identity_file")), None),
        known_hosts=value_or(text(tree.get("known_hosts")), None),
    )


def read_discovery(entry: Entry | None) -> Discovery | None:
    """Return the discovery; None if it is not set, or has no valid kind."""
    if entry is None or not isinstance(entry.value, Mapping):
        return None
    tree = entry.value
    kind = choice(tree.get("kind"), DiscoveryKind)
    if kind is None:
        return None
    return Discovery(
        kind=kind,
        span=entry.key.span,
        interfaces=texts(tree.get("interfaces")),
        addresses=texts(tree.get("address")),
        port=value_or(integer(tree.get("port")), DEFAULT_SERVER_PORT),
        start=flag(tree.get("start"), default=False),
        peers=texts(tree.get("peers")),
        given=tuple(key(item) for item in entries(tree)),
    )


def read_recording(entry: Entry | None) -> Recording | None:
    """Return what the system records; None if it is not set."""
    if entry is None or not isinstance(entry.value, Mapping):
        return None
    tree = entry.value
    return Recording(
        folder=value_or(text(tree.get("folder")), "bags"),
        topics=texts(tree.get("topics")),
        services=texts(tree.get("services")),
        actions=texts(tree.get("actions")),
        exclude=texts(tree.get("exclude")),
        ring_s=value_or(number(tree.get("ring_s")), None),
        split_mb=value_or(number(tree.get("split_mb")), None),
        split_s=value_or(number(tree.get("split_s")), None),
    )
