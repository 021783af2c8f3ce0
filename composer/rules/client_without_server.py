"""A client of a service or action that no node provides."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.near_miss import nearest_channel
from composer.analysis.wiring import external_hint, lonely_ends, place_of
from composer.analysis.words import end_name
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC322",
        name="client-without-server",
        severity=Severity.WARNING,
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for services and actions that have only clients."""
    for kind in (PortKind.CLIENT, PortKind.ACTION_CLIENT):
        for end in lonely_ends(context, kind):
            if end.port.required is None:
                place, labels = place_of(end)
                yield Diagnostic(
                    RULE,
                    f"no node in this system provides '{end.port.full_name}', "
                    f"which '{end_name(end)}' calls",
                    place,
                    labels,
                    nearest_channel(context, end) or external_hint(end),
                )
