"""The computers of a system."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import field
from pathlib import Path, PurePosixPath

from composer.fast_dataclass import dataclass
from composer.source import Located, Span

#: See rcl's domain_id.c; above 101 the ports of a participant may meet the ephemeral ones of Linux.
HIGHEST_DOMAIN_ID = 232


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


def private_files(hosts: Iterable[Host], root: Path) -> tuple[PurePosixPath, ...]:
    """Return the private keys of hosts that are below ``root``, relative to it.

    They are never copied to other computers, nor into images.
    """
    found: set[PurePosixPath] = set()
    for host in hosts:
        if host.identity_file is not None and not host.identity_file.startswith("~"):
            path = os.path.relpath(root / host.identity_file, root)
            if not path.startswith(".."):
                found.add(PurePosixPath(path))
    return tuple(sorted(found))


def pattern_of(path: PurePosixPath) -> str:
    """Return the pattern of one file below a root, for rsync and for .dockerignore."""
    return "/" + re.sub(r"[*?\[]", r"\\\g<0>", str(path))


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


def login_problem(text: str) -> str | None:
    """Return what is wrong with an address or a user; None if programs can take it as one word."""
    if not text:
        return "is empty"
    if text.startswith("-"):
        return "begins with '-'"
    if any(character.isspace() or not character.isprintable() for character in text):
        return "contains spaces or control characters"
    if set(text) & set("@/'\"\\"):
        return "contains '@', '/', quotes or backslashes"
    return None
