"""An action that is over as soon as it begins."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC332",
        name="action-as-service",
        severity=Severity.INFO,
        summary="An action server gives its result at once, without feedback.",
        why=(
            "An action is for work that takes time, tells how far it is, and can be canceled. For "
            "an answer at once a service does the same with a third of the endpoints."
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at action servers that are declared in YAML throughout."""
    for node in context.system.nodes:
        if node.behavior is not None:
            continue
        for port in node.ports_of(PortKind.ACTION_SERVER):
            if port.result is not None and port.feedback is None:
                yield Diagnostic(
                    RULE,
                    f"action server '{port.name}' has a result at once, as a service would",
                    port.name.span,
                    hint="use a service, or give feedback",
                )
