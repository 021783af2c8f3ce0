"""A discovery server that other computers cannot reach."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, error
from composer.model.discovery import host_of, is_loopback

RULE = error(
    code="RC498",
    name="local-discovery",
    summary="Processes of other computers are to use a local address for discovery.",
    why=(
        "For each computer, 127.0.0.1 and localhost are the computer itself, so its processes "
        "would look for the server, or for their peers, in the wrong place."
    ),
    bad="""\
system: robot
discovery: {kind: server, address: localhost, start: true}
hosts: {jetson: {workspace: ~/robot}}
processes: {vision: {nodes: [camera], host: jetson}}
nodes:
  camera: {on_activate: {log: started}}
  arm: {on_activate: {log: started}}
""",
    good="""\
system: robot
discovery: {kind: server, address: 192.168.1.10, start: true}
hosts: {jetson: {workspace: ~/robot}}
processes: {vision: {nodes: [camera], host: jetson}}
nodes:
  camera: {on_activate: {log: started}}
  arm: {on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
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
                RULE,
                f"'{text}' is not the same computer for all processes",
                text.span,
                (Label(host.span, "a process on another computer"),),
                hint="use the address of the computer in the network",
            )
