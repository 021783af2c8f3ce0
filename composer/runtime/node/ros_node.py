"""The ROS node of a running node, with only the endpoints for tools that its model declares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter

from composer.model import Node
from composer.runtime.ros.type_description import limit_type_descriptions


class _NoPublisher:
    """Replaces the publisher of /parameter_events."""

    def publish(self, _: ParameterEvent) -> None:
        """Do nothing."""


class _NodeWithoutParameterEvents(RosNode):
    """A node that does not publish /parameter_events, for which rclpy has no option."""

    def create_publisher(self, msg_type: Any, topic: str, *args: Any, **kwargs: Any) -> Any:
        """Create a publisher, except for the one of /parameter_events that rclpy creates."""
        if msg_type is ParameterEvent:
            return _NoPublisher()
        return super().create_publisher(msg_type, topic, *args, **kwargs)


def make_ros_node(model: Node, arguments: Sequence[str] = ()) -> RosNode:
    """Return a ROS node for ``model``, with command-line ``arguments`` of rcl.

    It does not publish /rosout: the node's log does.
    """
    offers = model.introspection
    kind = RosNode if offers.parameters else _NodeWithoutParameterEvents
    overrides = []
    if not offers.type_description:
        overrides.append(Parameter("start_type_description_service", value=False))
    node = kind(
        model.ros_name.value,
        namespace=model.namespace.value,
        cli_args=list(arguments),
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,  # see parameter_services.py
        parameter_overrides=overrides,
    )
    limit_type_descriptions(node)
    return node
