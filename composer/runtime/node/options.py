"""How a node is run, what all nodes of the process share, and how its ROS node is created."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter

from composer.base.fast_dataclass import dataclass
from composer.model import Node
from composer.model.qos import QosProfile
from composer.runtime.callbacks.observers import Chains, MessageSnapshots
from composer.runtime.executors.sources import EventCounts
from composer.runtime.host_options import Instruments, Recorder, Target
from composer.runtime.intra_process.router import LocalRouter
from composer.runtime.node.managed_node import ManagedContext
from composer.runtime.node_time import SimTimeSource
from composer.runtime.ros.service_requests import limit_type_descriptions
from composer.runtime.transforms.listener import TransformListeners

#: rmw's profile of parameter events.
_EVENTS_PROFILE = QosProfile(depth=1000)


@dataclass(frozen=True, slots=True)
class ProcessContext:
    """What all nodes of the process share: the manager node, and what runs on its loop."""

    manager: RosNode
    simulated_time: SimTimeSource
    events: EventCounts
    transforms: TransformListeners


@dataclass(frozen=True, slots=True)
class NodeOptions(ManagedContext):
    """How a node of this process is run.

    ``router`` connects its ports with those of the other nodes of the process; ``chains`` are
    those of the system; ``seen_messages`` is set if messages are checked for changes by callbacks;
    ``make_library_node(node)`` returns the rclpy node that the libraries of its behavior use.
    ``instruments`` belong to a test.
    """

    router: LocalRouter
    chains: Chains
    process: ProcessContext
    seen_messages: MessageSnapshots | None
    make_library_node: Callable[[Any], Any]
    instruments: Instruments | None


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


@dataclass(frozen=True, slots=True)
class _RecordedEvents:
    """The publisher of /parameter_events of a node, recorded."""

    publisher: Any
    tap: Target

    def publish(self, event: ParameterEvent) -> None:
        """Publish and record an event."""
        self.publisher.publish(event)
        self.tap.put(event)


def record_parameter_events(node: RosNode, recorder: Recorder | None) -> None:
    """Record the parameters of a node as they are declared and changed, if that is requested."""
    if recorder is None:
        return
    tap = recorder.tap("/parameter_events", "rcl_interfaces/msg/ParameterEvent", _EVENTS_PROFILE)
    if tap is not None:
        events: Any = _RecordedEvents(node._parameter_event_publisher, tap)
        node._parameter_event_publisher = events
