"""An action server that returns its result immediately."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.diagnostics import Diagnostic, info
from composer.model import ImplementationKind, PortKind

RULE = info(
    code="RC332",
    name="action-as-service",
    summary="An action server returns its result immediately, without feedback.",
    why=(
        "Actions are for long-running work that reports progress and can be canceled. For an "
        "immediate response, a service does the same with a third of the endpoints."
    ),
    bad="""\
system: pattern
nodes:
  navigator:
    action_servers:
      navigate:
        type: composer_interfaces/action/Navigate
        result: {success: true}
""",
    good="""\
system: pattern
nodes:
  navigator:
    action_servers:
      navigate:
        type: composer_interfaces/action/Navigate
        feedback: {count: 10, period_ms: 100, message: {progress_percent: "{count * 10.0}"}}
        result: {success: true}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the action servers that are declared entirely in YAML."""
    affected = context.once(earlier_errors).nodes  # feedback may be misspelled
    for node in context.system.nodes:
        if node.implementation is not ImplementationKind.DECLARATIVE:
            continue
        if node.name.value in affected:
            continue
        for port in node.ports_of(PortKind.ACTION_SERVER):
            if port.result is not None and port.feedback is None:
                yield Diagnostic(
                    RULE,
                    f"action server '{port.name}' returns its result immediately, like a service",
                    port.name.span,
                    hint="use a service, or add feedback",
                )
