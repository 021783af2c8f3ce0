"""An expression with a name that is not in scope."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.messages.expressions import EVENT_NAMES, ExpressionSite, expression_sites
from composer.analysis.spans import part_of_path
from composer.diagnostics import Diagnostic, error, suggestion

RULE = error(
    code="RC209",
    name="unknown-name",
    summary="An expression uses a name that is not in scope.",
    why=(
        "The available names depend on the event: 'message' in a subscription, 'request' in a "
        "service, 'response' in on_response, and so on. 'parameters', 'state', 'count', 'now' "
        "and 'node' are always available."
    ),
    bad="""\
system: names
nodes:
  listener:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{msg.data}"}
""",
    good="""\
system: names
nodes:
  listener:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{message.data}"}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the first part of every path."""
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            if path.root in site.names:
                continue
            yield Diagnostic(
                RULE,
                f"name '{path.root}' is not available here",
                part_of_path(site.span, site.expression, path),
                hint=_hint(path.root, site),
            )


def _hint(name: str, site: ExpressionSite) -> str | None:
    if site.node.parameter(name) is not None and "parameters" in site.names:
        return f"write 'parameters.{name}'"
    if any(known.value == name for known, _ in site.node.state) and "state" in site.names:
        return f"write 'state.{name}'"
    own = EVENT_NAMES.get(site.event) if site.event is not None else None
    if own and any(name in names for names in EVENT_NAMES.values()):
        return f"use '{own[0]}' here"
    return suggestion(name, site.names)
