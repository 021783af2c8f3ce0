"""The processes of a system, the computers that run them, and how they discover each other."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import field
from enum import StrEnum
from pathlib import Path, PurePosixPath

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span

#: See rcl's domain_id.c; above 101 the ports of a participant may meet the ephemeral ones of Linux.
HIGHEST_DOMAIN_ID = 232
#: RFC 1123, as Kubernetes and docker compose accept it for names.
_DNS_LABEL = re.compile(r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?")
_USER = re.compile(r"\w[\w.+-]*")


#: ROS reads from it in which enclave a process is.
ENCLAVE_VARIABLE = "ROS_SECURITY_ENCLAVE_OVERRIDE"
DEFAULT_SERVER_PORT = 11811
_HIGHEST_PORT = 65535
_IPV4_PARTS, _BYTE, _FIRST_MULTICAST = 4, 255, 224
#: RFC 1123, and underscores, which resolvers accept.
_HOST_NAME = re.compile(r"(?=.{1,253}\Z)[A-Za-z0-9_]([A-Za-z0-9_.-]*[A-Za-z0-9_])?\Z")
_LIKE_IPV4 = re.compile(r"[0-9.]+\Z")
#: Linux has names of up to 15 characters.
_INTERFACE = re.compile(r"[A-Za-z0-9_.-]{1,15}\Z")


@dataclass(frozen=True, slots=True)
class Process:
    """A process with nodes of the system.

    ``nodes`` are the nodes that it names; a node may also name its process itself. ``cpus`` and
    ``priority`` are as for executors, and apply to all of its threads. If it uses more than
    ``memory_mb`` of memory, it fails. Without a ``host``, it runs on the computer of the system.
    """

    name: Located[str]
    span: Span = field(compare=False)
    nodes: tuple[Located[str], ...] = ()
    cpus: tuple[int, ...] = ()
    priority: int | None = None
    environment: tuple[tuple[Located[str], str], ...] = ()
    memory_mb: Located[float] | None = None
    host: Located[str] | None = None


@dataclass(frozen=True, slots=True)
class Host:
    """A computer that runs processes of the system.

    It is reached by ssh at ``address``, by default its name. The project is in ``workspace`` there;
    ``python`` and ``setup`` are files there, ``identity_file`` and ``known_hosts`` files here.
    """

    name: Located[str]
    span: Span = field(compare=False)
    address: Located[str]
    port: int | None = None
    user: Located[str] | None = None
    workspace: Located[str] | None = None
    python: str | None = None
    setup: tuple[str, ...] = ()
    environment: tuple[tuple[Located[str], str], ...] = ()
    identity_file: str | None = None
    known_hosts: str | None = None

    @property
    def login(self) -> str:
        """The address, with the user if that is set: ``robot@192.168.1.20``."""
        return self.address.value if self.user is None else f"{self.user}@{self.address}"


def own_enclave(environment: Mapping[str, str], full_name: str) -> dict[str, str]:
    """Return the variable for a process of a system, if ``environment`` sets an enclave at all.

    As in the policy that ``compose export sros2`` writes, the enclave of a process is its full
    name.
    """
    return {ENCLAVE_VARIABLE: full_name} if environment.get(ENCLAVE_VARIABLE) else {}


def key_file(name: str, root: Path) -> Path:
    """Return the path of a file of ssh; a relative one begins at ``root``."""
    with suppress(RuntimeError):  # the home folder of an unknown user
        return root / Path(name).expanduser()
    return root / name


def workspace_problem(text: str) -> str | None:
    """Return what is wrong with a workspace, to which files are copied; None if it is safe."""
    problem: str | None = "is neither absolute nor below the home folder (~/)"
    match PurePosixPath(text).parts:
        case parts if ".." in parts or not text.isprintable():
            problem = "contains '..' or control characters"
        case ("/" | "//",):
            problem = "is the root of the file system"
        case ("~",) | ("/", "home", _):
            problem = "is a home folder"
        case ("/", _):
            problem = "is a folder of the operating system"
        case ("/" | "//" | "~", *_):
            problem = None
    return problem


def domain_problem(text: str) -> str | None:
    """Return what is wrong with a value of ROS_DOMAIN_ID; None if ROS accepts it."""
    is_number = text.isascii() and text.isdigit()
    digits = text.lstrip("0")[:9]  # int() refuses thousands of digits
    if not text or (is_number and int(digits or 0) <= HIGHEST_DOMAIN_ID):
        return None
    return f"is not a number from 0 to {HIGHEST_DOMAIN_ID}"


def name_problem(text: str) -> str | None:
    """Return what is wrong with the name of a host, which names files, pods and profiles."""
    if _DNS_LABEL.fullmatch(text):
        return None
    return "is not a DNS label: up to 63 letters, digits and '-', which is not at an end"


def address_problem(text: str) -> str | None:
    """Return what is wrong with the address of a host: an IP address or a name."""
    if ":" not in text:
        return peer_problem(text)
    from ipaddress import IPv6Address  # noqa: PLC0415 - takes 3 ms, and few files have one

    address, separator, zone = text.partition("%")
    with suppress(ValueError):
        IPv6Address(address)
        if not separator or interface_problem(zone) is None:
            return None
    return "is neither an IP address nor a host name"


def user_problem(text: str) -> str | None:
    """Return what is wrong with the name of a user."""
    if _USER.fullmatch(text):
        return None
    return "is not a user name: letters, digits, '_', '.', '+' and '-', which is not at the start"


def key_file_problem(text: str) -> str | None:
    """Return what is wrong with the path of a file that the options of ssh name."""
    if not text.isprintable() or set(text) & set('"\\$'):
        return "contains quotes, backslashes, '$' or control characters, which ssh does not accept"
    return None


class DiscoveryKind(StrEnum):
    """How participants find each other."""

    MULTICAST = "multicast"
    SERVER = "server"
    PEERS = "peers"


@dataclass(frozen=True, slots=True)
class Discovery:
    """The ``discovery`` of a system.

    ``interfaces`` belong to multicast, ``peers`` to peers, and the other keys to server.
    ``addresses`` are written as ``HOST`` or ``HOST:PORT``. ``given`` are the keys that are set.
    """

    kind: Located[DiscoveryKind]
    span: Span = field(compare=False)
    interfaces: tuple[Located[str], ...] = ()
    addresses: tuple[Located[str], ...] = ()
    port: int = DEFAULT_SERVER_PORT
    start: bool = False
    peers: tuple[Located[str], ...] = ()
    given: tuple[Located[str], ...] = field(default=(), compare=False)

    @property
    def variables(self) -> dict[str, str]:
        """The environment variables that implement it in any process of ROS."""
        match self.kind.value:
            case DiscoveryKind.SERVER:
                servers = (f"{host}:{port}" for host, port in self.servers)
                # Other clients of a server only discover the endpoints that match their own.
                return {"ROS_DISCOVERY_SERVER": ";".join(servers), "ROS_SUPER_CLIENT": "TRUE"}
            case DiscoveryKind.PEERS:
                peers = ";".join(peer.value for peer in self.peers)
                # With this range, ROS asks this computer and the peers, without multicast.
                return {"ROS_STATIC_PEERS": peers, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
            case DiscoveryKind.MULTICAST:
                return {}

    @property
    def servers(self) -> tuple[tuple[str, int], ...]:
        """The host and the port of each server, in order. The rules have checked them."""
        split = ((host_of(item.value), port_of(item.value)) for item in self.addresses)
        return tuple((host, int(port) if port else self.port) for host, port in split)


def host_of(address: str) -> str:
    """Return the first part of ``HOST`` or ``HOST:PORT``."""
    return address.partition(":")[0]


def port_of(address: str) -> str | None:
    """Return the second part of ``HOST:PORT``; None without one."""
    _, colon, port = address.partition(":")
    return port if colon else None


def is_loopback(host: str) -> bool:
    """Return whether a host is the computer itself, whichever that is."""
    return host == "localhost" or (_LIKE_IPV4.match(host) is not None and host.startswith("127."))


def server_problem(address: str) -> str | None:
    """Return what is wrong with ``HOST`` or ``HOST:PORT``; None if it is valid."""
    port = port_of(address)
    if port is None or address.count(":") > 1:
        return peer_problem(address)
    if not (port.isascii() and port.isdigit() and 1 <= int(port[:6]) <= _HIGHEST_PORT):
        return f"has no valid port: use a number from 1 to {_HIGHEST_PORT}"
    return peer_problem(host_of(address))


def peer_problem(host: str) -> str | None:
    """Return what is wrong with an address without a port; None if it is valid."""
    if host.count(":") > 1:
        return "is an IPv6 address, which the profiles for Fast DDS do not use"
    if ":" in host:
        return "has a port, which peers do not have"
    if _LIKE_IPV4.match(host) is None:
        return None if _HOST_NAME.match(host) else "is neither an IPv4 address nor a host name"
    parts = host.split(".")
    if len(parts) != _IPV4_PARTS or not all(map(_is_byte, parts)):
        return "is not an IPv4 address"
    if not 0 < int(parts[0]) < _FIRST_MULTICAST:
        return "is not the address of a computer"
    return None


def _is_byte(text: str) -> bool:
    return 0 < len(text) <= len(str(_BYTE)) and int(text) <= _BYTE


def interface_problem(text: str) -> str | None:
    """Return what is wrong with the name or the address of an interface; None if it is valid."""
    if _LIKE_IPV4.match(text) is not None:
        return peer_problem(text)
    return None if _INTERFACE.match(text) else "is neither an IPv4 address nor an interface name"
