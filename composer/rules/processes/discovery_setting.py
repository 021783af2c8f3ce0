"""A key of discovery that its kind needs, or does not have."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from composer.analysis.context import Context
from composer.analysis.earlier_errors import is_misspelled
from composer.diagnostics import Diagnostic, Label, error
from composer.model import DiscoveryKind
from composer.source import Located

RULE = error(
    code="RC496",
    name="discovery-setting",
    summary="A setting of discovery is missing, or has no effect with its kind.",
    why=(
        "Processes that look for each other in different ways do not find each other. A server "
        "without an address cannot be found either."
    ),
    bad="""\
system: lights
discovery: {kind: multicast, address: 192.168.1.10}
nodes:
  lamp: {on_activate: {log: started}}
""",
    good="""\
system: lights
discovery: {kind: server, address: 192.168.1.10}
nodes:
  lamp: {on_activate: {log: started}}
""",
)
_NEEDED = {DiscoveryKind.SERVER: "address", DiscoveryKind.PEERS: "peers"}
_KIND_OF_KEY = {
    "interfaces": DiscoveryKind.MULTICAST,
    "address": DiscoveryKind.SERVER,
    "port": DiscoveryKind.SERVER,
    "start": DiscoveryKind.SERVER,
    "peers": DiscoveryKind.PEERS,
}


def check(context: Context) -> Iterator[Diagnostic]:
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
            yield _missing(discovery.kind, needed, others)
        return
    for key in others:
        yield Diagnostic(
            RULE,
            f"'{key}' has no effect with discovery of kind '{kind}'",
            key.span,
            hint=f"remove it, or set 'kind: {_KIND_OF_KEY[key.value]}'",
        )


def _missing(
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
    return Diagnostic(RULE, message, kind.span, labels, hint)
