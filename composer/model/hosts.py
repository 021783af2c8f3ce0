"""The processes of a system, each with some of its nodes, and the computers that run them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import field
from pathlib import Path, PurePosixPath

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.model.discovery import interface_problem, peer_problem

#: See rcl's domain_id.c; above 101 the ports of a participant may meet the ephemeral ones of Linux.
HIGHEST_DOMAIN_ID = 232
#: RFC 1123, as Kubernetes and docker compose accept it for names.
_DNS_LABEL = re.compile(r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?")
_USER = re.compile(r"\w[\w.+-]*")


#: ROS reads from it in which enclave a process is.
ENCLAVE_VARIABLE = "ROS_SECURITY_ENCLAVE_OVERRIDE"


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
