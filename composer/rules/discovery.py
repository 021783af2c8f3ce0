"""How processes discover each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from composer.base.diagnostics import Diagnostic, Label, error
from composer.base.source import Located
from composer.model import DiscoveryKind
from composer.model.discovery import (
    host_of,
    interface_problem,
    is_loopback,
    peer_problem,
    server_problem,
)
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.earlier_errors import is_misspelled

INVALID_DISCOVERY = error("RC496", "invalid-discovery")

_NEEDED = {DiscoveryKind.SERVER: "address", DiscoveryKind.PEERS: "peers"}
_KIND_OF_KEY = {
    "interfaces": DiscoveryKind.MULTICAST,
    "address": DiscoveryKind.SERVER,
    "port": DiscoveryKind.SERVER,
    "start": DiscoveryKind.SERVER,
    "peers": DiscoveryKind.PEERS,
}


def check_discovery_setting(context: Context) -> Iterator[Diagnostic]:
    """Check that the keys of discovery are those of its kind."""
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
