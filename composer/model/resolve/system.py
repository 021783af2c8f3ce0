"""Resolve a whole file: a system, or a single node type."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Map
from dataclasses import replace
from functools import cache, partial

from composer.base.diagnostics import Diagnostic
from composer.base.source import Located, SourceFile, Span
from composer.language.rules import LimitedDiagnostics
from composer.language.tree import (
    Entry,
    Mapping,
    Scalar,
    choice,
    entries,
    environment,
    flag,
    integer,
    integers,
    is_opaque,
    key,
    mapping,
    number,
    plain_text,
    text,
    text_or_opaque,
    texts,
    value_or,
)
from composer.model import (
    DEFAULT_SUPERVISION,
    USE_SIM_TIME,
    Delivery,
    Executor,
    ExecutorKind,
    Host,
    Node,
    PrimaryState,
    Process,
    System,
    UnknownKey,
)
from composer.model.assembly.limits import SystemLimits
from composer.model.hosts import DEFAULT_SERVER_PORT, Discovery, DiscoveryKind
from composer.model.names import join
from composer.model.resolve.connections import read_chains, read_connections
from composer.model.resolve.node import SystemContext, resolve_node
from composer.model.resolve.node_settings import read_supervision
from composer.model.resolve.node_types import NodeTypeLoader
from composer.model.resolve.overrides import Overrides
from composer.model.resolve.parameter_files import read_parameter_files
from composer.model.resolve.parameters import sections_of, without_sections_of_others
from composer.model.resolve.qos import qos_table
from composer.model.system import Recording
from composer.project.node_types import SourceFolders

ROOT = "/"
DEFAULT_THREADS = 2
#: Keys of the file of a node type that its nodes do not have.
_NOT_OF_NODES = frozenset(("node", "variables", "extends", "type"))


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


def resolve_system(
    tree: Mapping, source: SourceFile, folders: SourceFolders, overrides: Overrides
) -> tuple[System, list[Diagnostic]]:
    """Return the system of an expanded tree. See :func:`composer.model.resolve.resolve`."""
    diagnostics = LimitedDiagnostics()
    qos = qos_table(tree.get("qos_profiles"))
    namespace = _system_namespace(tree, overrides)
    joined, port_connections = read_connections(tree.get("connections"), namespace.value, qos)
    types = NodeTypeLoader(folders, qos, diagnostics)
    written = tree.get("lifecycle")
    lifecycle = written if isinstance(written, Mapping) else Mapping((), tree.span)
    system_supervision = read_supervision(lifecycle, DEFAULT_SUPERVISION)
    written = tree.get("parameter_files")
    files = read_parameter_files(written, folders.home, folders.node_types.project, diagnostics)
    clock = _use_sim_time(tree, overrides)
    processes = tuple(map(_process, entries(tree.get("processes"))))
    context = SystemContext(
        namespace,
        types,
        port_connections,
        overrides,
        system_supervision,
        tree.get("introspection"),
        files,
        cache(partial(sections_of, files)),
        clock,
        processes_of_nodes(processes),
        SystemLimits(diagnostics),
    )
    nodes = without_sections_of_others(
        [resolve_node(entry, context) for entry in entries(tree.get("nodes"))]
    )
    system = System(
        name=_name(tree, "system"),
        source=source,
        nodes=nodes,
        span=_name_span(tree, "system"),
        namespace=namespace.value,
        namespace_span=namespace.span,
        description=plain_text(tree.get("description")),
        connections=joined,
        chains=read_chains(tree.get("chains")),
        qos_profiles=qos.named,
        qos_references=tuple(qos.references),
        executors=tuple(_executor(entry) for entry in entries(tree.get("executors"))),
        processes=processes,
        hosts=tuple(map(_host, entries(tree.get("hosts")))),
        discovery=read_discovery(tree.entry("discovery")),
        recording=read_recording(tree.entry("recording")),
        autostart=value_or(choice(lifecycle.get("autostart"), PrimaryState), PrimaryState.ACTIVE),
        supervision=system_supervision,
        delivery=value_or(choice(tree.get("delivery"), Delivery), Delivery.AUTO),
        use_sim_time=any(flag(entry.value, default=False) for entry in clock),
        implied_dependencies=flag(lifecycle.get("implied_dependencies"), default=True),
        arguments=overrides.argument_words,
        unknown=_unknown_nodes(nodes, overrides),
        parameter_files=frozenset(section.name.span.file for section in files.sections),
        unmatched_parameters=files.unmatched(nodes),
    )
    return system, diagnostics


def resolve_node_type(
    tree: Mapping, source: SourceFile, folders: SourceFolders, overrides: Overrides
) -> tuple[System, list[Diagnostic]]:
    """Return a system with a single node of a node type, to validate the type alone."""
    name, span = _name(tree, "node"), _name_span(tree, "node")
    declared = tuple(entry for entry in tree if entry.name not in _NOT_OF_NODES)
    node = Entry(Scalar(name.value, name.span), Mapping(declared, tree.span))
    nodes = Entry(Scalar("nodes", span), Mapping((node,), span))
    system, diagnostics = resolve_system(Mapping((nodes,), span), source, folders, overrides)
    alone = replace(system.nodes[0], given=())
    system = replace(
        system, name=name, nodes=(alone,), description=alone.description, node_type=True
    )
    return system, diagnostics


def _name(tree: Mapping, kind: str) -> Located[str]:
    return text_or_opaque(tree.get(kind), _name_span(tree, kind))


def _name_span(tree: Mapping, kind: str) -> Span:
    entry = tree.entry(kind)
    return entry.value.span if entry is not None else tree.span


def _system_namespace(tree: Mapping, overrides: Overrides) -> Located[str]:
    """Return the absolute namespace of the system. The command line overrides the file."""
    entry = tree.get("namespace")
    if overrides.namespace is None and entry is None:
        return Located(ROOT, tree.span)
    written = overrides.namespace or text_or_opaque(entry, tree.span)
    return written if is_opaque(written.value) else written.map(lambda name: join(ROOT, name))


def _use_sim_time(tree: Mapping, overrides: Overrides) -> tuple[Entry, ...]:
    """Return the ``use_sim_time`` entry for all nodes. The command line overrides the file."""
    written = overrides.use_sim_time or tree.entry(USE_SIM_TIME)
    if written is None or not isinstance(written.value, Scalar):
        return ()
    return (written,) if isinstance(written.value.value, bool) else ()


def _unknown_nodes(nodes: tuple[Node, ...], overrides: Overrides) -> tuple[UnknownKey, ...]:
    names = tuple(item.name.value for item in nodes)
    known = set(names)
    return tuple(
        UnknownKey("nodes", item.node, names)
        for item in overrides.parameters
        if item.node.value not in known
    )


def _executor(entry: Entry) -> Executor:
    tree = mapping(entry)
    threads = integer(tree.get("threads"))
    return Executor(
        name=key(entry),
        kind=value_or(choice(tree.get("kind"), ExecutorKind), ExecutorKind.EVENTS),
        span=entry.key.span,
        threads=value_or(threads, DEFAULT_THREADS),
        threads_span=threads.span if threads is not None else None,
        cpus=integers(tree.get("cpus")),
        priority=value_or(integer(tree.get("priority")), None),
    )
