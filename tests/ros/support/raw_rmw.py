"""Publishers and subscriptions of rmw with any DDS names, which rcl would refuse.

rmw does not check topic names if a QoS profile avoids the conventions of ROS, and a participant
announces the names of its nodes as plain messages on the topic ``ros_discovery_info``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable

from rclpy.node import Node
from rclpy.type_support import check_for_type_support
from rmw_dds_common.msg import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo

PREFIX_BYTES = 12
_RELIABLE, _TRANSIENT_LOCAL, _KEEP_LAST = 1, 1, 1
#: The entity id of a participant (DDSI-RTPS, 9.3.1.2).
_PARTICIPANT = bytes((0, 0, 1, 0xC1))


class _Duration(ctypes.Structure):
    _fields_ = [("sec", ctypes.c_uint64), ("nsec", ctypes.c_uint64)]


class _Profile(ctypes.Structure):
    """rmw_qos_profile_t."""

    _fields_ = [
        ("history", ctypes.c_int),
        ("depth", ctypes.c_size_t),
        ("reliability", ctypes.c_int),
        ("durability", ctypes.c_int),
        ("deadline", _Duration),
        ("lifespan", _Duration),
        ("liveliness", ctypes.c_int),
        ("lease", _Duration),
        ("avoid_ros_namespace_conventions", ctypes.c_bool),
    ]


class _Options(ctypes.Structure):
    """rmw_publisher_options_t and rmw_subscription_options_t."""

    _fields_ = [
        ("payload", ctypes.c_void_p),
        ("network_flow", ctypes.c_int),
        ("content_filter", ctypes.c_void_p),
    ]


RCL, RMW = ctypes.CDLL("librcl.so"), ctypes.CDLL("librmw_fastrtps_cpp.so")
RCL.rcl_node_get_rmw_handle.restype = ctypes.c_void_p
RMW.rmw_create_publisher.restype = RMW.rmw_create_subscription.restype = ctypes.c_void_p
ctypes.pythonapi.PyCapsule_GetPointer.restype = ctypes.c_void_p
PROFILE = _Profile(
    history=_KEEP_LAST,
    depth=1,
    reliability=_RELIABLE,
    durability=_TRANSIENT_LOCAL,
    avoid_ros_namespace_conventions=True,
)


def own_prefix(node: Node) -> bytes:
    """Return the prefix of the participant of a node."""
    (end,) = [
        end
        for end in node.get_publishers_info_by_topic("/rosout")
        if (end.node_name, end.node_namespace) == (node.get_name(), node.get_namespace())
    ]
    return bytes(end.endpoint_gid[:PREFIX_BYTES])


def _pointer(kind: type, name: str) -> int:
    """Return a pointer that the metaclass of a message class has."""
    capsule = ctypes.py_object(getattr(type(kind), name))
    return int(ctypes.pythonapi.PyCapsule_GetPointer(capsule, None))


def create(node: Node, kind: type, name: str, *, publisher: bool = True) -> int:
    """Return rmw's publisher or subscription of a DDS topic."""
    check_for_type_support(kind)
    make = RMW.rmw_create_publisher if publisher else RMW.rmw_create_subscription
    handle = ctypes.c_void_p(RCL.rcl_node_get_rmw_handle(ctypes.c_void_p(node.handle.pointer)))
    options = ctypes.byref(_Options())
    text = ctypes.c_char_p(name.encode())
    support = ctypes.c_void_p(_pointer(kind, "_TYPE_SUPPORT"))
    made = make(handle, support, text, ctypes.byref(PROFILE), options)
    assert made, name
    return int(made)


def _publish(publisher: int, message: ParticipantEntitiesInfo) -> None:
    make = ctypes.PYFUNCTYPE(ctypes.c_void_p)
    convert = ctypes.PYFUNCTYPE(ctypes.c_bool, ctypes.py_object, ctypes.c_void_p)
    raw = make(_pointer(ParticipantEntitiesInfo, "_CREATE_ROS_MESSAGE"))()
    convert(_pointer(ParticipantEntitiesInfo, "_CONVERT_FROM_PY"))(message, raw)
    result = RMW.rmw_publish(ctypes.c_void_p(publisher), ctypes.c_void_p(raw), None)
    assert result == 0


class NodeNames:
    """What a participant announces about its nodes; here, any participant and any names."""

    def __init__(self, node: Node, prefix: bytes, names: Iterable[tuple[str, str]]) -> None:
        self._publisher = create(node, ParticipantEntitiesInfo, "ros_discovery_info")
        self._message = ParticipantEntitiesInfo(
            gid=Gid(data=list(prefix + _PARTICIPANT)),
            node_entities_info_seq=[
                NodeEntitiesInfo(node_namespace=namespace, node_name=name)
                for namespace, name in names
            ],
        )

    def announce(self) -> None:
        _publish(self._publisher, self._message)
