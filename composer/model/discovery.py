"""How the processes of a system discover each other and other ROS nodes."""

from __future__ import annotations

import re
from dataclasses import field
from enum import StrEnum

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span

DEFAULT_SERVER_PORT = 11811
_HIGHEST_PORT = 65535
_IPV4_PARTS, _BYTE, _FIRST_MULTICAST = 4, 255, 224
#: RFC 1123, and underscores, which resolvers accept.
_HOST_NAME = re.compile(r"(?=.{1,253}\Z)[A-Za-z0-9_]([A-Za-z0-9_.-]*[A-Za-z0-9_])?\Z")
_LIKE_IPV4 = re.compile(r"[0-9.]+\Z")
#: Linux has names of up to 15 characters.
_INTERFACE = re.compile(r"[A-Za-z0-9_.-]{1,15}\Z")


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
