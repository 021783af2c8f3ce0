"""The processes of a system, their computers and environment, and how they discover each other."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, Label, error, warning
from composer.base.source import Located
from composer.language.rules import UNUSED_DECLARATION
from composer.model import Channel, DiscoveryKind, Host
from composer.model.hosts import (
    address_problem,
    domain_problem,
    host_of,
    interface_problem,
    is_loopback,
    key_file_problem,
    name_problem,
    peer_problem,
    server_problem,
    user_problem,
    workspace_problem,
)
from composer.model.names import topic_name_problem
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.subjects import (
    NODES_OF_PROCESSES,
    earlier_errors,
    is_misspelled,
)
from composer.rules.executors import LOST_BETWEEN_PROCESSES
from composer.rules.references import unknown_names

CONFLICTING_PROCESS = error("RC479", "conflicting-process")
MANY_SERVICES = warning("RC488", "many-services")
_DOMAIN, _DISCOVERY_RANGE = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE"
#: Of about 180 nodes with all services.
_MOST_ENDPOINTS = 5000
INVALID_HOST = error("RC492", "invalid-host")
ENVIRONMENT_VARIABLE = error("RC494", "environment-variable")
_WORKSPACE_HINT = "name a folder that only holds this project, such as ~/robot"
_VARIABLE_HINT = "use letters, digits and '_', and no digit at the start"
_VARIABLE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
INVALID_DISCOVERY = error("RC496", "invalid-discovery")
_NEEDED = {DiscoveryKind.SERVER: "address", DiscoveryKind.PEERS: "peers"}
_KIND_OF_KEY = {
    "interfaces": DiscoveryKind.MULTICAST,
    "address": DiscoveryKind.SERVER,
    "port": DiscoveryKind.SERVER,
    "start": DiscoveryKind.SERVER,
    "peers": DiscoveryKind.PEERS,
}


def check_unknown_process(context: Context) -> Iterator[Diagnostic]:
    """Check the processes of nodes, and the nodes of processes."""
    system = context.system
    named = (
        (f"node '{node.name}' runs in '{node.process}'", node.process) for node in system.nodes
    )
    yield from unknown_names(context, "process", named)
    for process in system.processes:
        named = ((f"process '{process.name}' names '{name}'", name) for name in process.nodes)
        subjects = (("nodes of process", process.name.value), NODES_OF_PROCESSES)
        for unknown in unknown_names(context, "node", named):
            yield replace(unknown, subjects=(*unknown.subjects, *subjects))


def check_conflicting_process(context: Context) -> Iterator[Diagnostic]:
    """Check that the processes share no node, and that each has one."""
    system = context.system
    named: dict[str, Located[str]] = {}
    first: dict[str, tuple[str, Located[str]]] = {}
    for node in system.nodes:
        if node.process is not None:
            named[node.name.value] = node.process
    for process in system.processes:
        for node_name in process.nodes:
            known = first.setdefault(node_name.value, (process.name.value, node_name))
            other = named.get(node_name.value)
            if known[0] != process.name.value:
                where = known[1].span
                text = known[0]
            elif other is not None and other.value != process.name.value:
                where, text = other.span, other.value
            else:
                continue
            yield Diagnostic(
                CONFLICTING_PROCESS,
                f"node '{node_name}' is in the processes '{text}' and '{process.name}'",
                node_name.span,
                related=(Label(where, f"in '{text}'"),),
                hint="name it in one of them",
                relies_on=tuple(
                    (kind, name)
                    for name in (text, process.name.value)
                    for kind in ("process", "nodes of process")
                ),
            )
    used = {process.value for process in named.values()}
    known_names = {process.name.value for process in system.processes}
    has_others = not used <= known_names  # undeclared-name reports them
    for process in system.processes:
        problem = topic_name_problem(process.name.value)
        if problem is not None or "/" in process.name.value:
            what = problem or "contains '/'"
            yield Diagnostic(
                CONFLICTING_PROCESS, f"process '{process.name}' {what}", process.name.span
            )
        elif (
            not (process.nodes or process.name.value in used or has_others)
            and not context.once(earlier_errors).any
        ):
            yield Diagnostic(
                CONFLICTING_PROCESS,
                f"process '{process.name}' has no nodes",
                process.name.span,
                relies_on=(("process", process.name.value),),
            )


def check_separate_process(context: Context) -> Iterator[Diagnostic]:
    """Check the variables that the processes set."""
    for process in context.system.processes:
        for name, value in process.environment:
            if name.value == _DOMAIN:
                yield Diagnostic(
                    CONFLICTING_PROCESS,
                    f"process '{process.name}' would be in a ROS domain of its own",
                    name.span,
                    hint=f"set {_DOMAIN} for 'compose run' instead, which all processes inherit",
                )
            elif name.value == _DISCOVERY_RANGE and value == "OFF":
                yield Diagnostic(
                    CONFLICTING_PROCESS,
                    f"process '{process.name}' would discover no other process",
                    name.span,
                    hint="remove it",
                )


def check_isolation_between_processes(context: Context) -> Iterator[Diagnostic]:
    """Check the connections with 'isolation', with all ports of their topics."""
    if all(connection.isolation is None for connection in context.system.connections):
        return
    channel_of = {end.key: channel for channel in context.channels for end in channel.ends}
    for connection in context.system.connections:
        if connection.isolation is None:
            continue
        ports = connection.ends
        found = [channel_of.get((end.node, end.port)) for end in ports]
        known = [channel for channel in found if channel is not None]
        if len(known) < len(found) or not known or any(map(_has_pair_in_process, known)):
            continue
        if not all(channel.sources and channel.sinks for channel in known):
            continue
        yield Diagnostic(
            LOST_BETWEEN_PROCESSES,
            f"'isolation' of '{connection.name}' has no effect: no two of its nodes are in the "
            "same process",
            connection.isolation.span,
            hint="assign them to one process, or remove 'isolation'",
        )


def _has_pair_in_process(channel: Channel) -> bool:
    """Return whether messages of the channel may stay in a process."""
    return any(
        source.node.implementation.in_process
        and sink.node.implementation.in_process
        and source.node.process == sink.node.process
        for source in channel.sources
        for sink in channel.sinks
    )


def check_many_services(context: Context) -> Iterator[Diagnostic]:
    """Check the services of nodes if they are in several processes."""
    system = context.system
    if not system.processes:
        return
    found = [
        node.introspection.endpoints for node in system.nodes if node.implementation.in_process
    ]
    if sum(found) > _MOST_ENDPOINTS:
        yield Diagnostic(
            MANY_SERVICES,
            f"the nodes have about {sum(found)} endpoints for tools: their processes may not start "
            "within the time limit",
            system.name.span,
            hint="disable what no tool uses, in 'introspection' of the system",
        )


def check_unknown_host(context: Context) -> Iterator[Diagnostic]:
    """Check the hosts of processes."""
    named = (
        (f"process '{process.name}' runs on '{process.host}'", process.host)
        for process in context.system.processes
    )
    for diagnostic in unknown_names(context, "host", named):
        yield replace(diagnostic, hint=diagnostic.hint or "declare it under 'hosts:'")


def check_unused_host(context: Context) -> Iterator[Diagnostic]:
    """Check that each host has a process; a misspelled one is reported where it is named."""
    system = context.system
    named = [process.host for process in system.processes if process.host is not None]
    used = {name.value for name in named}
    known = {host.name.value for host in system.hosts}
    if context.is_partial or used - known or any(map(is_unresolved, used)):
        return
    for host in system.hosts:
        if host.name.value not in used:
            yield Diagnostic(
                UNUSED_DECLARATION,
                f"host '{host.name}' has no process",
                host.name.span,
                hint=f"set 'host: {host.name}' of a process",
            )


def check_invalid_host(context: Context) -> Iterator[Diagnostic]:
    """Check the hosts."""
    for host in context.system.hosts:
        yield from _check_host(host)


def _check_host(host: Host) -> Iterator[Diagnostic]:
    problem = None if is_unresolved(host.name.value) else name_problem(host.name.value)
    if problem is not None:
        yield Diagnostic(INVALID_HOST, f"the name of host '{host.name}' {problem}", host.name.span)
    address = None if host.address == host.name else host.address  # reported once
    checks: tuple[tuple[str, Located[str] | None, Callable[[str], str | None], str | None], ...] = (
        ("address", address, address_problem, None),
        ("user", host.user, user_problem, None),
        ("identity_file", _located(host, host.identity_file), key_file_problem, None),
        ("known_hosts", _located(host, host.known_hosts), key_file_problem, None),
        ("workspace", host.workspace, workspace_problem, _WORKSPACE_HINT),
    )
    for what, written, find_problem, hint in checks:
        if written is None or is_unresolved(written.value):
            continue
        problem = find_problem(written.value)
        if problem is not None:
            text = f"the {what} of host '{host.name}', '{written}', {problem}"
            yield Diagnostic(INVALID_HOST, text, written.span, hint=hint)
    for name, value in host.environment:
        problem = domain_problem(value) if name.value == "ROS_DOMAIN_ID" else None
        if problem is not None and not is_unresolved(value):
            text = f"the ROS_DOMAIN_ID of host '{host.name}', '{value}', {problem}"
            yield Diagnostic(INVALID_HOST, text, name.span)


def _located(host: Host, text: str | None) -> Located[str] | None:
    return None if text is None else Located(text, host.span)


def check_environment_variable(context: Context) -> Iterator[Diagnostic]:
    """Check the environment variables of processes, hosts and executables."""
    system = context.system
    executables = [node.executable for node in system.nodes if node.executable is not None]
    environments = [
        *(process.environment for process in system.processes),
        *(host.environment for host in system.hosts),
        *(executable.environment for executable in executables),
    ]
    for environment in environments:
        for name, _ in environment:
            if not is_unresolved(name.value) and not _VARIABLE_NAME.fullmatch(name.value):
                text = f"'{name}' is not a name of an environment variable"
                yield Diagnostic(ENVIRONMENT_VARIABLE, text, name.span, hint=_VARIABLE_HINT)


def check_discovery_setting(context: Context) -> Iterator[Diagnostic]:
    """Check that each key of discovery belongs to its kind."""
    discovery = context.system.discovery
    if discovery is None:
        return
    kind = discovery.kind.value
    given = {key.value for key in discovery.given}
    others = [key for key in discovery.given if _KIND_OF_KEY.get(key.value, kind) is not kind]
    needed = _NEEDED.get(kind)
    if needed is not None and needed not in given:
        if not is_misspelled(context, needed, discovery.kind.span):
            yield _missing_setting(discovery.kind, needed, others)
        return
    for key in others:
        yield Diagnostic(
            INVALID_DISCOVERY,
            f"'{key}' has no effect with discovery of kind '{kind}'",
            key.span,
            hint=f"remove it, or set 'kind: {_KIND_OF_KEY[key.value]}'",
        )


def _missing_setting(
    kind: Located[DiscoveryKind], needed: str, others: Sequence[Located[str]]
) -> Diagnostic:
    """Report a key that is missing, and those that have no effect because of the same mistake."""
    hint = "list the other computers of the system"
    if kind.value is DiscoveryKind.SERVER:
        hint = "name the computer of the server"
    if others:
        hint = f"{hint}, or set 'kind: {_KIND_OF_KEY[others[0].value]}'"
    labels = tuple(Label(key.span, "this has no effect") for key in others)
    message = f"discovery of kind '{kind}' needs '{needed}'"
    return Diagnostic(INVALID_DISCOVERY, message, kind.span, labels, hint)


def check_discovery_address(context: Context) -> Iterator[Diagnostic]:
    """Check the addresses and interfaces of discovery."""
    discovery = context.system.discovery
    if discovery is not None:
        yield from _check_all("address", discovery.addresses, server_problem)
        yield from _check_all("peer", discovery.peers, peer_problem)
        yield from _check_all("interface", discovery.interfaces, interface_problem)


def _check_all(
    what: str, written: tuple[Located[str], ...], find_problem: Callable[[str], str | None]
) -> Iterator[Diagnostic]:
    first: dict[str, Located[str]] = {}
    for text in written:
        if is_unresolved(text.value):
            continue
        problem = find_problem(text.value)
        earlier = first.setdefault(text.value, text)
        if problem is not None:
            yield Diagnostic(INVALID_DISCOVERY, f"{what} '{text}' {problem}", text.span)
        elif earlier is not text:
            label = Label(earlier.span, "the first one")
            yield Diagnostic(INVALID_DISCOVERY, f"{what} '{text}' is repeated", text.span, (label,))


def check_local_discovery(context: Context) -> Iterator[Diagnostic]:
    """Check the addresses of discovery in a system of several computers."""
    system = context.system
    discovery = system.discovery
    addresses = {host.name.value: host.address.value for host in system.hosts}
    hosts = [process.host for process in system.processes if process.host is not None]
    host = next((item for item in hosts if not is_loopback(addresses.get(item.value, ""))), None)
    if discovery is None or host is None:
        return
    for text in (*discovery.addresses, *discovery.peers):
        if is_loopback(host_of(text.value)):
            yield Diagnostic(
                INVALID_DISCOVERY,
                f"'{text}' is not the same computer for all processes",
                text.span,
                (Label(host.span, "a process on another computer"),),
                hint="use the address of the computer in the network",
            )
