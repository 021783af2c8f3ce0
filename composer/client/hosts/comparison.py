"""The differences between the inventories of two computers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum

from composer.base.fast_dataclass import dataclass
from composer.client.hosts.inventory import Inventory

_HASH_CHARACTERS = 14  # of RIHS01_ and the digest: enough to compare by eye


class Kind(Enum):
    """What differs, with what to do about it."""

    VERSION = "install the same versions on all computers"
    INTERFACE = "build it there from the same definitions: compose interface build"
    FILE = "copy the project with 'compose hosts sync'"


@dataclass(frozen=True, slots=True)
class Difference:
    """Something that another computer has, or not, unlike this one."""

    kind: Kind
    text: str


def differences(here: Inventory, there: Inventory) -> tuple[Difference, ...]:
    """Return how ``there`` differs from ``here``; nothing if it can run the system."""
    return (*_versions(here, there), *_interfaces(here, there), *_files(here, there))


def _versions(here: Inventory, there: Inventory) -> Iterator[Difference]:
    if there.python != here.python:
        yield Difference(Kind.VERSION, f"Python is {there.python} there, {here.python} here")
    # A package on one computer only is not a difference: systems need the interfaces of packages.
    for name in sorted(here.packages.keys() & there.packages.keys()):
        ours, theirs = here.packages[name], there.packages[name]
        if ours != theirs:
            yield Difference(Kind.VERSION, f"{name} is {theirs} there, {ours} here")


def _interfaces(here: Inventory, there: Inventory) -> Iterator[Difference]:
    for name, ours, theirs in _unlike(here.interfaces, there.interfaces):
        if theirs is None:
            yield Difference(Kind.INTERFACE, f"interface {name} is not built there")
        elif ours is None:
            yield Difference(Kind.INTERFACE, f"interface {name} is not built here")
        else:
            hashes = f"{theirs[:_HASH_CHARACTERS]} there, {ours[:_HASH_CHARACTERS]} here"
            yield Difference(Kind.INTERFACE, f"interface {name} differs: {hashes}")


def _files(here: Inventory, there: Inventory) -> Iterator[Difference]:
    for name, _, theirs in _unlike(here.files, there.files):
        text = f"{name} is not there" if theirs is None else f"{name} differs"
        yield Difference(Kind.FILE, text)


def _unlike(
    here: Mapping[str, str | None], there: Mapping[str, str | None]
) -> Iterator[tuple[str, str | None, str | None]]:
    for name, ours in here.items():
        theirs = there.get(name)
        if ours != theirs:
            yield name, ours, theirs
