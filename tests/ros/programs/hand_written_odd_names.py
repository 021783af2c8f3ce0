"""A participant with names that no ROS node can have, as other DDS software may announce them.

Prints ``ready``.

rmw does not check topic names if a QoS profile avoids the conventions of ROS, and a participant
announces the names of its nodes as plain messages on the topic ``ros_discovery_info``.
"""

from __future__ import annotations

import ctypes
import time

import rclpy
from rclpy.node import Node
from rclpy.type_support import check_for_type_support
from rmw_dds_common.msg import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo
from std_msgs.msg import String
from std_srvs.srv import Trigger

TOPICS = ("rt/", "rt/a b", "rt/1st", "rt//twice", "rt/red\x1b[31m")
SERVICES = ("rq/manager/is_activeRequest", "rq/lab x/manager/is_activeRequest")
NODES = (("/", ""), ("", ""), ("/lab", "with space"), ("/lab/", "end"), ("/lab\x1b[31m", "red"))
PERIOD_S = 0.2
_RELIABLE, _TRANSIENT_LOCAL, _KEEP_LAST = 1, 1, 1
#: The entity id of a participant (DDSI-RTPS, 9.3.1.2), and the length of its prefix.
_PARTICIPANT, _PREFIX = bytes((0, 0, 1, 0xC1)), 12


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


def create(node: Node, kind: type, name: str, *, publisher: bool = True) -> int:
    """Return rmw's publisher or subscription of a DDS topic."""
    check_for_type_support(kind)
    support = ctypes.pythonapi.PyCapsule_GetPointer(
        ctypes.py_object(type(kind)._TYPE_SUPPORT), None
    )
    make = RMW.rmw_create_publisher if publisher else RMW.rmw_create_subscription
    handle = ctypes.c_void_p(RCL.rcl_node_get_rmw_handle(ctypes.c_void_p(node.handle.pointer)))
    options = ctypes.byref(_Options())
    text = ctypes.c_char_p(name.encode())
    made = make(handle, ctypes.c_void_p(support), text, ctypes.byref(PROFILE), options)
    assert made, name
    return int(made)


def announce(publisher: int, message: ParticipantEntitiesInfo) -> None:
    metaclass = type(ParticipantEntitiesInfo)

    def function(name: str, result: type | None, *arguments: type) -> object:
        pointer = ctypes.pythonapi.PyCapsule_GetPointer(
            ctypes.py_object(getattr(metaclass, name)), None
        )
        return ctypes.PYFUNCTYPE(result, *arguments)(pointer)

    raw = function("_CREATE_ROS_MESSAGE", ctypes.c_void_p)()
    function("_CONVERT_FROM_PY", ctypes.c_bool, ctypes.py_object, ctypes.c_void_p)(message, raw)
    result = RMW.rmw_publish(ctypes.c_void_p(publisher), ctypes.c_void_p(raw), None)
    assert result == 0


def main() -> None:
    rclpy.init()
    node = Node("ordinary", namespace="lab")
    known = node.create_publisher(String, "/lab/ordinary", 1)
    for name in TOPICS:
        create(node, String, name)
    for name in SERVICES:
        create(node, Trigger.Request, name, publisher=False)
    own = node.get_publishers_info_by_topic(known.topic_name)[0]
    prefix = bytes(own.endpoint_gid[:_PREFIX])
    message = ParticipantEntitiesInfo(
        gid=Gid(data=list(prefix + _PARTICIPANT)),
        node_entities_info_seq=[
            NodeEntitiesInfo(node_namespace=namespace, node_name=name) for namespace, name in NODES
        ]
        + [NodeEntitiesInfo(node_namespace="/lab", node_name="ordinary")],
    )
    publisher = create(node, ParticipantEntitiesInfo, "ros_discovery_info")
    print("ready", flush=True)
    while True:
        announce(publisher, message)
        time.sleep(PERIOD_S)


if __name__ == "__main__":
    main()
