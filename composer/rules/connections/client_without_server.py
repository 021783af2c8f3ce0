"""A client of a service or action that no node provides."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.unconnected import (
    external_hint,
    name_location,
    nearest_channel,
    unconnected_ports,
)
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, warning
from composer.model import PortKind

RULE = warning(
    code="RC322",
    name="client-without-server",
    summary="No node in the system provides the service or action that a client calls.",
    why=(
        "Every call times out. The usual cause is a name that differs between client and "
        "server. If an external node provides it, set 'external: true'."
    ),
    bad="""\
system: unserved
nodes:
  operator:
    clients: {reset: {type: std_srvs/srv/Trigger}}
""",
    good="""\
system: unserved
nodes:
  operator:
    clients: {reset: {type: std_srvs/srv/Trigger, external: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for services and actions that have only clients."""
    for kind in (PortKind.CLIENT, PortKind.ACTION_CLIENT):
        for endpoint in unconnected_ports(context, kind):
            if endpoint.port.required is None:
                place, labels = name_location(endpoint)
                yield Diagnostic(
                    RULE,
                    f"no node in this system provides '{endpoint.port.full_name}', "
                    f"which '{port_name(endpoint)}' calls",
                    place,
                    labels,
                    nearest_channel(context, endpoint) or external_hint(endpoint),
                )
