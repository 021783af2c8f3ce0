"""Keeps what this process publishes from coming back to its own subscriptions by DDS.

rmw knows ``ignore_local_publications``, rclpy has no word for it. The flag is set where rmw looks
at it for each message: in the options of ``rmw_subscription_t``. Where its fields lie is an
assumption about ROS 2 Jazzy's ABI, so it is tried once per process, with real endpoints, before
anything relies on it.
"""

from __future__ import annotations

import ctypes
import time
from functools import cache
from typing import Any
from uuid import uuid4

from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import Empty

_MIDDLEWARES = ("rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp")
_PATIENCE_S = 1.0
_LOOK_EVERY_S = 0.0005
_TRIAL = "_compose_trial"


class _Options(ctypes.Structure):
    """``rmw_subscription_options_t``."""

    _fields_ = (
        ("rmw_specific_subscription_payload", ctypes.c_void_p),
        ("ignore_local_publications", ctypes.c_bool),
        ("require_unique_network_flow_endpoints", ctypes.c_int),
        ("content_filter_options", ctypes.c_void_p),
    )


class _Subscription(ctypes.Structure):
    """``rmw_subscription_t``."""

    _fields_ = (
        ("implementation_identifier", ctypes.c_char_p),
        ("data", ctypes.c_void_p),
        ("topic_name", ctypes.c_char_p),
        ("options", _Options),
        ("can_loan_messages", ctypes.c_bool),
        ("is_cft_enabled", ctypes.c_bool),
    )


class NotIgnored(Exception):
    """Own publications cannot be kept from coming back; the text says why."""


_RCL = ctypes.CDLL("librcl.so")
_RCL.rcl_subscription_get_rmw_handle.restype = ctypes.c_void_p
_RCL.rcl_subscription_get_rmw_handle.argtypes = (ctypes.c_void_p,)


def ignore_own_publications(subscription: Subscription) -> None:
    """Have ``subscription`` take nothing that was published in this process. Raises NotIgnored."""
    with subscription.handle:
        address = _RCL.rcl_subscription_get_rmw_handle(subscription.handle.pointer)
        if not address:
            raise NotIgnored("rcl gives no rmw handle")
        inside = _Subscription.from_address(address)
        topic = inside.topic_name.decode()
        if topic != subscription.topic_name:
            raise NotIgnored(f"rmw's subscription of '{subscription.topic_name}' has '{topic}'")
        inside.options.ignore_local_publications = True


@cache
def why_not_ignored(context: Context | None = None) -> str | None:
    """Try it, once per process. Return why it does not work here, or None when it does.

    ``context`` is the one of rclpy's that is tried with, its default unless given.
    """
    middleware = get_rmw_implementation_identifier()
    if middleware not in _MIDDLEWARES:
        return f"nothing is known of {middleware}"
    node = Node(
        _TRIAL,
        context=context,
        enable_rosout=False,
        start_parameter_services=False,
        use_global_arguments=False,
    )
    try:
        _try_with(node)
    except NotIgnored as error:
        return str(error)
    finally:
        node.destroy_node()
    return None


def _try_with(node: Node) -> None:
    """Publish to two subscriptions, one of which ignores it. Raises NotIgnored."""
    profile = QoSProfile(depth=2, reliability=ReliabilityPolicy.RELIABLE)
    topic = f"{_TRIAL}/t{uuid4().hex}"
    ignoring = node.create_subscription(Empty, topic, lambda _: None, profile)
    publisher = node.create_publisher(Empty, topic, profile)
    hearing = node.create_subscription(Empty, topic, lambda _: None, profile)
    # Outsiders are counted by what has matched: own subscriptions have to be in there at once.
    matched = publisher.get_subscription_count()
    if matched != 2:
        raise NotIgnored(f"{matched} of 2 subscriptions of the process have matched at once")
    publisher.publish(Empty())
    if not (_comes(ignoring) and _comes(hearing)):
        raise NotIgnored("a publication of the process does not come back anyway")
    ignore_own_publications(ignoring)
    publisher.publish(Empty())
    if not _comes(hearing):
        raise NotIgnored("a subscription that ignores nothing hears nothing")
    if _take(ignoring):
        raise NotIgnored("a publication of the process came back")


def _comes(subscription: Subscription) -> bool:
    until_s = time.monotonic() + _PATIENCE_S
    while not (taken := _take(subscription)) and time.monotonic() < until_s:
        time.sleep(_LOOK_EVERY_S)
    return taken


def _take(subscription: Any) -> bool:
    return subscription.handle.take_message(subscription.msg_type, False) is not None
