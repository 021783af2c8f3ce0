"""The frames of tf2 that a node broadcasts and looks up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.model.geometry import Transform
from composer.model.ports import Port, PortKind, Qos
from composer.model.qos import Durability, QosProfile

TF_TYPE = "tf2_msgs/msg/TFMessage"
TF_TOPIC = "/tf"
TF_STATIC_TOPIC = "/tf_static"

#: The messages with a pose and a time, from which a transform can be broadcast.
POSE_TYPES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)

#: The QoS of tf2_ros. A static broadcaster sends all of its transforms in each message.
_DYNAMIC = QosProfile(depth=100)
_STATIC = QosProfile(depth=1, durability=Durability.TRANSIENT_LOCAL)
_STATIC_LISTENER = QosProfile(depth=100, durability=Durability.TRANSIENT_LOCAL)


@dataclass(frozen=True, slots=True)
class StaticTransform:
    """A transform that does not change; without ``values``, child and parent coincide.

    With ``from_code``, the code of the node broadcasts it. What nodes that were not written for the
    composer broadcast is up to them. ``angles_rad`` are the angles of the rotation that are written
    in radians.
    """

    child: Located[str]
    parent: Located[str]
    values: Located[Transform] | None
    from_code: bool = False
    angles_rad: tuple[Located[float], ...] = ()


@dataclass(frozen=True, slots=True)
class DynamicTransform:
    """A transform that changes: with each message of the subscription ``source``, or by code."""

    child: Located[str]
    parent: Located[str]
    source: Located[str] | None


@dataclass(frozen=True, slots=True)
class Transforms:
    """The frames of a node. ``lookup`` are those that it looks up; None if it looks up none.

    ``ports`` are the publishers and subscriptions on /tf and /tf_static that follow from them. They
    have no place among the ports of the node: only the composer uses them.
    """

    span: Span = field(compare=False)
    static: tuple[StaticTransform, ...] = ()
    dynamic: tuple[DynamicTransform, ...] = ()
    lookup: Located[tuple[Located[str], ...]] | None = None
    ports: tuple[Port, ...] = ()

    @property
    def broadcasts(self) -> tuple[StaticTransform | DynamicTransform, ...]:
        """All transforms that the node broadcasts."""
        return self.static + self.dynamic

    @property
    def publishers(self) -> tuple[Port, ...]:
        """The publishers among the ports."""
        return tuple(port for port in self.ports if port.kind is PortKind.PUBLISHER)

    def port(self, kind: PortKind, name: str) -> Port | None:
        """Return the port of a kind that is declared as ``name``: /tf or /tf_static."""
        found = (port for port in self.ports if port.kind is kind and port.name.value == name)
        return next(found, None)


def transform_ports(
    span: Span, *, has_static: bool, has_dynamic: bool, looks_up: bool
) -> Iterator[Port]:
    """Yield the ports on /tf and /tf_static that a node with transforms needs."""
    if has_static:
        yield _port(PortKind.PUBLISHER, TF_STATIC_TOPIC, _STATIC, span)
    if has_dynamic:
        yield _port(PortKind.PUBLISHER, TF_TOPIC, _DYNAMIC, span)
    if looks_up:
        yield _port(PortKind.SUBSCRIPTION, TF_STATIC_TOPIC, _STATIC_LISTENER, span)
        yield _port(PortKind.SUBSCRIPTION, TF_TOPIC, _DYNAMIC, span)


def _port(kind: PortKind, topic: str, profile: QosProfile, span: Span) -> Port:
    name = Located(topic, span)
    return Port(
        kind=kind,
        name=name,
        interface=Located(TF_TYPE, span),
        ros_name=name,
        full_name=topic,
        qos=Qos(profile, span),
        span=span,
        external=True,  # tools and other nodes may use the topic as well
    )
