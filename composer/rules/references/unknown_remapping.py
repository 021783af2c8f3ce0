"""A remapping of a name that the node does not use."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import matched_ports, own_name
from composer.diagnostics import Diagnostic, Severity, error, suggestion
from composer.model import Node, Remapping
from composer.names import topic_name_problem
from composer.source import Located
from composer.spelling import is_typo

RULE = error(
    code="RC208",
    name="unknown-remapping",
    summary="A remapping names a topic, service or action that no port of the node uses.",
    why=(
        "ROS ignores such a remapping silently, and the port keeps its name. A class, an "
        "executable or an external node may use names that it does not declare: without "
        "'only_declared', only a probable misspelling is reported, as an info."
    ),
    bad="""\
system: renamed
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
    remappings: {chater: news}
""",
    good="""\
system: renamed
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
    remappings: {chatter: news}
""",
)

_RULE_IF_PASSED_ON = replace(RULE, severity=Severity.INFO)
#: Names that every ROS node has without declaring them, before expansion.
_EVERY_NODE = (
    "/clock",
    "/diagnostics",
    "/parameter_events",
    "/rosout",
    "~/describe_parameters",
    "~/get_parameter_types",
    "~/get_parameters",
    "~/get_type_description",
    "~/list_parameters",
    "~/set_parameters",
    "~/set_parameters_atomically",
    "~/change_state",
    "~/get_available_states",
    "~/get_available_transitions",
    "~/get_state",
    "~/get_transition_graph",
    "~/transition_event",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the name that each remapping replaces."""
    for node in context.system.nodes:
        if not node.complete or any(is_unresolved(port.ros_name.value) for port in node.ports):
            continue
        for remapping in node.remappings:
            source = remapping.source
            if _known(node, remapping) or (
                node.gets_undeclared and not _is_misspelled(node, source)
            ):
                continue
            yield Diagnostic(
                _RULE_IF_PASSED_ON if node.gets_undeclared else RULE,
                f"node '{node.name}' has no port named '{source}' to remap",
                source.span,
                hint=_hint(node, source.value),
            )


def _is_misspelled(node: Node, source: Located[str]) -> bool:
    return any(is_typo(source.value, port.ros_name.value) for port in node.ports)


def _known(node: Node, remapping: Remapping) -> bool:
    source = remapping.source.value
    if is_unresolved(source) or topic_name_problem(source) is not None:
        return True  # cannot be checked, or is reported by another rule
    return any(matched_ports(node, remapping)) or own_name(node, source) in {
        own_name(node, name) for name in _EVERY_NODE
    }


def _hint(node: Node, source: str) -> str | None:
    port = node.port(source)
    if port is not None:
        return f"the {port.kind.channel} of port '{source}' is named '{port.ros_name}'"
    return suggestion(source, [port.ros_name.value for port in node.ports])
