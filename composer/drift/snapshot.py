"""What somebody saw of a ROS graph at one moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from composer.model import PortKind
from composer.qos import QosProfile
from composer.tree import Plain

#: Services that every node has for tools (rcl_interfaces, lifecycle_msgs, type_description).
_TOOL_SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
    "change_state": "lifecycle_msgs/srv/ChangeState",
    "get_state": "lifecycle_msgs/srv/GetState",
    "get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
    "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
    "get_logger_levels": "rcl_interfaces/srv/GetLoggerLevels",
    "set_logger_levels": "rcl_interfaces/srv/SetLoggerLevels",
    "get_type_description": "type_description_interfaces/srv/GetTypeDescription",
}
#: Topics that nodes have for tools.
_TOOL_TOPICS = {
    "/rosout": "rcl_interfaces/msg/Log",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
}
_TRANSITION_EVENT = "lifecycle_msgs/msg/TransitionEvent"


@dataclass(frozen=True, slots=True)
class EndSeen:
    """A publisher, subscription, service, ... of a node.

    ``qos`` is what the node really offers or asks for: that of topics is told to everybody (but
    for history and depth), that of services and actions to nobody, so it is None.
    """

    kind: PortKind
    name: str
    type: str
    qos: QosProfile | None = None

    @property
    def is_for_tools(self) -> bool:
        """True for what nodes have beside what they are for: parameters, logs, lifecycle."""
        last = self.name.rpartition("/")[2]
        if self.kind.channel.value == "service":
            return _TOOL_SERVICES.get(last) == self.type
        if self.kind.channel.value == "topic":
            known = _TOOL_TOPICS.get(self.name) == self.type
            return known or (last == "transition_event" and self.type == _TRANSITION_EVENT)
        return False


@dataclass(frozen=True, slots=True)
class NodeSeen:
    """A node of the graph.

    ``state`` is its lifecycle state: empty for a node that has none, None when it did not say.
    ``parameters`` are its values by name, None when it did not say. ``count`` is how many nodes
    have that name: the ends are those of all of them.
    """

    full_name: str
    ends: tuple[EndSeen, ...] = ()
    state: str | None = ""
    parameters: Mapping[str, Plain] | None = field(default_factory=dict)
    count: int = 1

    @property
    def is_hidden(self) -> bool:
        """True for nodes of tools: a part of their name begins with an underscore."""
        return any(part.startswith("_") for part in self.full_name.split("/"))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The nodes of the graph. Endpoints for tools are left out."""

    nodes: tuple[NodeSeen, ...]

    def node(self, full_name: str) -> NodeSeen | None:
        """Return the node of that name, or None."""
        return next((node for node in self.nodes if node.full_name == full_name), None)
