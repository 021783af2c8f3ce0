"""An address or a network interface that cannot be one."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Label, error
from composer.model.discovery import interface_problem, peer_problem, server_problem
from composer.source import Located

RULE = error(
    code="RC497",
    name="discovery-address",
    summary="An address or an interface of discovery is not valid, or is repeated.",
    why=(
        "Fast DDS ignores what it cannot read: nodes would start, and never discover each "
        "other. The position of a server in the list is part of its identity."
    ),
    bad="""\
system: lights
discovery: {kind: server, address: "192.168.1.10:118110"}
nodes:
  lamp: {on_activate: {log: started}}
""",
    good="""\
system: lights
discovery: {kind: server, address: "192.168.1.10:11811"}
nodes:
  lamp: {on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
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
            yield Diagnostic(RULE, f"{what} '{text}' {problem}", text.span)
        elif earlier is not text:
            label = Label(earlier.span, "the first one")
            yield Diagnostic(RULE, f"{what} '{text}' is repeated", text.span, (label,))
