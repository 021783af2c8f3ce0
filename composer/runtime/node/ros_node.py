"""The ROS node under a running node, with no more endpoints for tools than it is to have."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter

from composer.model import Node


class _Nobody:
    """Stands where rclpy wants the publisher of /parameter_events."""

    def publish(self, _: ParameterEvent) -> None:
        """Tell nobody."""


class _QuietNode(RosNode):
    """A node that tells nobody of its parameters. rclpy has an option for the services only."""

    def create_publisher(self, msg_type: Any, topic: str, *args: Any, **kwargs: Any) -> Any:
        """Create a publisher, but none of /parameter_events, as rclpy does for each node."""
        if msg_type is ParameterEvent:
            return _Nobody()
        return super().create_publisher(msg_type, topic, *args, **kwargs)


def make_ros_node(model: Node) -> RosNode:
    """Return the ROS node of ``model``, in the graph. Its log has a publisher of its own."""
    offers = model.introspection
    kind = RosNode if offers.parameters else _QuietNode
    overrides = []
    if not offers.type_description:
        overrides.append(Parameter("start_type_description_service", value=False))
    return kind(
        model.name.value,
        namespace=model.namespace.value,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=offers.parameters,
        parameter_overrides=overrides,
    )
