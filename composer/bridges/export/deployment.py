"""The processes of a system as service managers and container engines see them.

A discovery server that the system starts is a service of its own, which does not end with nodes.
Files are written as YAML that parsers of YAML 1.1 and 1.2 read alike, with comments.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

from composer.base.fast_dataclass import dataclass
from composer.model import (
    DEFAULT_EXECUTOR,
    DiscoveryKind,
    ImplementationKind,
    OnFailure,
    Process,
    System,
)
from composer.model.hosts import ENCLAVE_VARIABLE, is_loopback, own_enclave
from composer.model.names import join

#: Longer than --grace of compose run, by which the process ends in any case.
STOP_WITHIN_S = 15
#: ROS reads these; the others of a sourced workspace follow from its setup file.
VARIABLES = (
    "FASTDDS_BUILTIN_TRANSPORTS",
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISCOVERY_SERVER",
    "ROS_DOMAIN_ID",
    "ROS_SECURITY_ENABLE",
    ENCLAVE_VARIABLE,
    "ROS_SECURITY_STRATEGY",
    "ROS_STATIC_PEERS",
    "ROS_SUPER_CLIENT",
)
_LONGEST_LABEL = 63
_MEGABYTE = 1_000_000
#: Begins like a name or a path, so that no parser takes it for a number, and has no syntax in it.
_PLAIN = re.compile(r"[A-Za-z_/.][A-Za-z0-9_/.+=@-]*\Z")
_NOT_TEXT = {"y", "n", "yes", "no", "on", "off", "true", "false", "null", ".inf", ".nan", "~"}
#: A key that stands for a comment; its value is the text.
_COMMENT = re.compile(r'^( *)"?#\d+"?: (.*)$', re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Service:
    """A process as one service.

    ``label`` is a unique DNS label. ``full_name``, the namespace of its manager, is its name for
    ``compose ps``. ``options`` follow ``compose run SYSTEM``. ``priority`` is the highest real-time
    priority that it needs. If it ``is_server``, it runs the discovery servers of a computer: of
    this one, or of ``server_host``.
    """

    label: str
    full_name: str
    options: tuple[str, ...] = ()
    process: Process | None = None  # None: the one that coordinates the others
    priority: int | None = None
    is_server: bool = False
    server_host: str | None = None

    def command(self, file: str) -> list[str]:
        """Return the words after ``compose`` that run the service; ``file`` is the system file."""
        if self.is_server:
            return ["hosts", "discovery-server", file, *self.options]
        return ["run", file, *self.options]

    def readiness(self, file: str) -> list[str]:
        """Return the words after ``compose`` that ask whether it is ready."""
        if self.is_server:
            return ["hosts", "discovery-server", file, *self.options, "--ready"]
        return ["ps", self.full_name, "--ready"]

    @property
    def is_coordinator(self) -> bool:
        """Whether it runs the whole system, in which the others are awaited."""
        return self.process is None and not self.is_server

    @property
    def host(self) -> str | None:
        """The name of the other computer that runs it."""
        if self.is_server:
            return self.server_host
        host = None if self.process is None else self.process.host
        return None if host is None or host.value == "localhost" else host.value

    @property
    def cpus(self) -> tuple[int, ...]:
        """The CPUs that it may use; empty for all."""
        return () if self.process is None else self.process.cpus

    @property
    def memory_bytes(self) -> int | None:
        """The maximum memory; None if it has no limit."""
        limit = None if self.process is None else self.process.memory_mb
        return None if limit is None else max(1, round(limit.value * _MEGABYTE))

    @property
    def environment(self) -> dict[str, str]:
        """The environment variables that the system sets."""
        declared = () if self.process is None else self.process.environment
        return {name.value: value for name, value in declared}

    @property
    def origin(self) -> str:
        """Where it is declared, for comments."""
        if self.is_server:
            return "The discovery server of the system."
        if self.process is None:
            return "The process that coordinates the system."
        span = self.process.span
        return f"Process '{self.process.name}' of the system, line {span.line}."


def services(system: System) -> tuple[Service, ...]:
    """Return the services of a system: the coordinating one, other processes, and servers."""
    namespace = join(system.namespace, system.name.value)
    processes = [f"{system.name}-{item.name}" for item in system.processes]
    servers = _server_hosts(system)
    names = [f"{system.name}-discovery" + (f"-{host}" if host else "") for host in servers]
    labels = _labels([system.name.value, *processes, *names])
    awaits = ("--await-processes",) if system.processes else ()
    given = system.arguments
    found = [Service(labels[0], namespace, (*given, *awaits), None, _priority(system, None))]
    for label, process in zip(labels[1:], system.processes, strict=False):
        name = process.name.value
        options = (*given, "--process", name)
        priority = _priority(system, process)
        found.append(Service(label, f"{namespace}/{name}", options, process, priority))
    for label, host in zip(labels[len(found) :], servers, strict=True):
        found.append(Service(label, namespace, given, is_server=True, server_host=host))
    return tuple(found)


def _server_hosts(system: System) -> list[str | None]:
    """Return the computers with discovery servers that the system starts; None is this one."""
    discovery = system.discovery
    if discovery is None or not discovery.start:
        return []
    names = {host.address.value: host.name.value for host in system.hosts}
    return list(dict.fromkeys(names.get(host) for host, _ in discovery.servers))


def is_restarted(system: System) -> bool:
    """Return whether a process that has failed is started again.

    ``on_failure: shutdown`` of the system means that a failure ends it.
    """
    return system.supervision.policy is not OnFailure.SHUTDOWN


def has_outside_nodes(system: System) -> bool:
    """Return whether nodes take part that no process of the system runs, as far as is known."""
    discovery = system.discovery
    if discovery is not None and discovery.kind.value is not DiscoveryKind.MULTICAST:
        hosts = [host for host, _ in discovery.servers]
        if not all(map(is_loopback, [*hosts, *(peer.value for peer in discovery.peers)])):
            return True
    return any(
        node.implementation is ImplementationKind.EXTERNAL
        or any(port.external for port in node.ports)
        for node in system.nodes
    )


def ros_variables(environment: Mapping[str, str], service: Service) -> dict[str, str]:
    """Return the variables that ROS reads, as far as they are set, with its own enclave."""
    found = {name: environment[name] for name in VARIABLES if environment.get(name)}
    return found | own_enclave(environment, service.full_name)


def _priority(system: System, process: Process | None) -> int | None:
    name = None if process is None else process.name.value
    used = {
        DEFAULT_EXECUTOR if node.executor is None else node.executor.value
        for node in system.nodes
        if (None if node.process is None else node.process.value) == name
    }
    priorities = [item.priority for item in system.executors if item.name.value in used]
    priorities += [] if process is None else [process.priority]
    return max((priority for priority in priorities if priority is not None), default=None)


def _labels(names: Iterable[str]) -> list[str]:
    """Return a DNS label for each name; equal ones get a number."""
    found: list[str] = []
    for name in names:
        text = re.sub(r"[^a-z0-9]+", "-", name.lower())[: _LONGEST_LABEL - 3].strip("-") or "system"
        label, number = text, 2
        while label in found:
            label, number = f"{text}-{number}", number + 1
        found.append(label)
    return found


class _Dumper(yaml.SafeDumper):
    """Quotes every text that some parser may take for something else, and indents lists."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        del indentless  # always of lists in mappings
        super().increase_indent(flow, indentless=False)

    def ignore_aliases(self, data: Any) -> bool:
        del data  # none is written as an alias of another
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    is_number = text.startswith(".") and text[1:2].isdigit()
    is_plain = _PLAIN.match(text) and text.lower() not in _NOT_TEXT and not is_number
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if is_plain else '"')


_Dumper.add_representer(str, _text)


def yaml_text(document: Mapping[str, Any]) -> str:
    """Return a document in the order of its keys.

    Keys such as ``#1`` stand for comments, whose values are their texts.
    """
    width: Any = math.inf  # a line that begins within a text could look like a comment
    text = yaml.dump(document, Dumper=_Dumper, sort_keys=False, width=width, allow_unicode=True)
    return _COMMENT.sub(_comment, text)


def _comment(match: re.Match[str]) -> str:
    indent, value = match.groups()
    return "\n".join(f"{indent}# {line}" for line in str(yaml.safe_load(value)).splitlines())


def without_variables(value: Any) -> Any:
    """Return a value in which docker compose and Kubernetes replace no variables."""
    match value:
        case str():
            return value.replace("$", "$$")
        case dict():
            return {key: without_variables(item) for key, item in value.items()}
        case list():
            return [without_variables(item) for item in value]
        case _:
            return value
