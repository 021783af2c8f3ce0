"""Two flags of the middleware that rclpy does not expose, and a test of both.

One keeps the publications of this process from reaching its own subscriptions by DDS:
``ignore_local_publications``, set where rmw reads it for each message, in the options of
``rmw_subscription_t``. The offsets are an assumption about the ABI of ROS 2 Jazzy, so a self-test
with real endpoints runs once per process before it is used.

The other is a byte that the middleware zeroes when a match changes, so that publishers can poll it.
As in ``readiness``, rcl must not call Python on the middleware's threads. The callback handed to
rcl is libc's ``bzero``, whose two arguments (an address, a count) have the calling convention of
``void (*)(const void * user_data, size_t count)``. It zeroes ``count`` bytes, so the buffer has
room for as many events as can be reported together.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar
from uuid import uuid4

from rclpy.context import Context
from rclpy.event_handler import QoSPublisherEventType, UnsupportedEventTypeError
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import Empty

from composer.runtime.clock import COMPUTER
from composer.runtime.executors.readiness import EVENT

T = TypeVar("T")

_SIZE = 1 << 20  # more events than can be reported together; Linux commits pages on first use

#: The first byte is zero once a subscription has matched or unmatched a publisher of this process.
MATCH_FLAG: Final = bytearray(_SIZE)

_ADDRESS = ctypes.addressof(ctypes.c_char.from_buffer(MATCH_FLAG))
_ZERO = ctypes.cast(ctypes.CDLL(None).bzero, ctypes.c_void_p)
_MIDDLEWARES = ("rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp")
_TIMEOUT_S = 1.0
_POLL_PERIOD_S = 0.0005
TEST_NODE = "_compose_trial"


class Matching:
    """The current generation of matches, which is replaced whenever a match changes.

    A publisher counts its matches once in each ``generation``. One flag and one generation serve
    all publishers: they stay in the cache, while an object per publisher would be fetched from
    memory for each message.
    """

    __slots__ = ("generation", "is_supported")

    def __init__(self) -> None:
        #: A unique object.
        self.generation = object()
        #: False if a match does not zero the flag here: then they are counted for each message.
        self.is_supported = True

    def begin_generation(self) -> None:
        """Begin a generation. Call it when the flag is zero."""
        # Replaced before the flag is set, so that other threads see the change even if this one
        # loses the interpreter's lock in between; and after, for a change in that moment.
        self.generation = object()
        MATCH_FLAG[0] = 1
        self.generation = object()


MATCHING: Final = Matching()


class MatchListener:
    """Zeroes the flag whenever a subscription matches or unmatches the publisher."""

    __slots__ = ("_event", "is_supported")

    def __init__(self, publisher: Publisher, *, enabled: bool = True) -> None:
        """Listen unless it is not ``enabled``: rmw has one callback per kind of event."""
        #: False if matches are not reported.
        self.is_supported = False
        if not (enabled and MATCHING.is_supported):
            return
        try:
            with publisher.handle:
                self._event = rclpy_implementation.EventHandle(
                    publisher.handle, QoSPublisherEventType.RCL_PUBLISHER_MATCHED
                )
        except UnsupportedEventTypeError:
            return
        with self._event:
            self.is_supported = EVENT(self._event.pointer, _ZERO, _ADDRESS) == 0

    def close(self) -> None:
        """Stop zeroing the flag. Call it before the publisher is destroyed."""
        if not self.is_supported:
            return
        with self._event:
            EVENT(self._event.pointer, None, 0)
        self._event.destroy_when_not_in_use()
        self.is_supported = False


def checked_match(publisher: Publisher, match: Callable[[], T]) -> T:
    """Return ``match()``, which matches a publisher, and check that it zeroes the flag."""
    MATCHING.is_supported = True
    listener = MatchListener(publisher)
    MATCHING.begin_generation()
    matched = match()
    MATCHING.is_supported = listener.is_supported and not MATCH_FLAG[0]
    listener.close()
    return matched


class RmwSubscriptionOptions(ctypes.Structure):
    """``rmw_subscription_options_t``."""

    _fields_ = (
        ("rmw_specific_subscription_payload", ctypes.c_void_p),
        ("ignore_local_publications", ctypes.c_bool),
        ("require_unique_network_flow_endpoints", ctypes.c_int),
        ("content_filter_options", ctypes.c_void_p),
    )


class RmwSubscription(ctypes.Structure):
    """``rmw_subscription_t``."""

    _fields_ = (
        ("implementation_identifier", ctypes.c_char_p),
        ("data", ctypes.c_void_p),
        ("topic_name", ctypes.c_char_p),
        ("options", RmwSubscriptionOptions),
        ("can_loan_messages", ctypes.c_bool),
        ("is_cft_enabled", ctypes.c_bool),
    )


class NotSupported(Exception):
    """Local publications cannot be ignored; the text is the reason."""


_RCL = ctypes.CDLL("librcl.so")
_RCL.rcl_subscription_get_rmw_handle.restype = ctypes.c_void_p
_RCL.rcl_subscription_get_rmw_handle.argtypes = (ctypes.c_void_p,)


def ignore_local(subscription: Subscription) -> None:
    """Make ``subscription`` ignore the publications of this process. Raises NotSupported."""
    with subscription.handle:
        address = _RCL.rcl_subscription_get_rmw_handle(subscription.handle.pointer)
        if not address:
            raise NotSupported("rcl has no rmw handle of the subscription")
        rmw_subscription = RmwSubscription.from_address(address)
        topic = rmw_subscription.topic_name.decode()
        if topic != subscription.topic_name:
            raise NotSupported(f"rmw's subscription of '{subscription.topic_name}' has '{topic}'")
        rmw_subscription.options.ignore_local_publications = True


@cache
def unsupported_reason(context: Context | None = None) -> str | None:
    """Run the self-test, once per process; return why it fails, or None if it passes.

    ``context`` is rclpy's context for the test, by default the default one.
    """
    middleware = get_rmw_implementation_identifier()
    if middleware not in _MIDDLEWARES:
        return f"{middleware} is not supported"
    node = Node(
        TEST_NODE,
        context=context,
        enable_rosout=False,
        start_parameter_services=False,
        use_global_arguments=False,
        # rclpy would leave this service in the graph until the process ends.
        parameter_overrides=[Parameter("start_type_description_service", value=False)],
    )
    try:
        _self_test(node)
    except NotSupported as error:
        return str(error)
    finally:
        node.destroy_node()
    return None


def _self_test(node: Node) -> None:
    """Publish to two subscriptions, and expect that one of them ignores it. Raises NotSupported."""
    profile = QoSProfile(depth=2, reliability=ReliabilityPolicy.RELIABLE)
    topic = f"{TEST_NODE}/t{uuid4().hex}"
    ignoring = node.create_subscription(Empty, topic, lambda _: None, profile)
    publisher = node.create_publisher(Empty, topic, profile)
    receiving = checked_match(
        publisher, lambda: node.create_subscription(Empty, topic, lambda _: None, profile)
    )
    # External subscriptions are counted as matches minus local ones: those must match at once.
    matched = publisher.get_subscription_count()
    if matched != 2:
        raise NotSupported(f"{matched} of 2 subscriptions of the process matched at once")
    publisher.publish(Empty())
    if not (_receives(ignoring) and _receives(receiving)):
        raise NotSupported("local publications are not received by default")
    ignore_local(ignoring)
    publisher.publish(Empty())
    if not _receives(receiving):
        raise NotSupported("a subscription without the flag received nothing")
    if _take(ignoring):
        raise NotSupported("a local publication was received despite the flag")


def _receives(subscription: Subscription) -> bool:
    until_s = COMPUTER.monotonic() + _TIMEOUT_S
    while not (taken := _take(subscription)) and COMPUTER.monotonic() < until_s:
        COMPUTER.sleep(_POLL_PERIOD_S)
    return taken


def _take(subscription: Any) -> bool:
    return subscription.handle.take_message(subscription.msg_type, False) is not None
