"""Records topics of the ROS graph, and publishes the messages of a bag to it.

Subscriptions have a QoS that matches their publishers. Messages are published at their times.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from functools import partial
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rosgraph_msgs.msg import Clock as ClockMessage

from composer.bags.bag import CDR, NANOSECONDS, BagError, BagMessage, BagTopic
from composer.bags.definitions import full_definition
from composer.bags.recorder import Recorder
from composer.base.fast_dataclass import dataclass
from composer.client.graph_names import InvalidNameError
from composer.client.messages.topics import TopicPublisher
from composer.client.messages.values import InvalidValueError, class_of
from composer.client.session import Deadline, Session
from composer.interfaces import Interfaces
from composer.model.names import is_hidden
from composer.model.qos import QosProfile, incompatibilities, strictest_compatible, strongest
from composer.model.system import owner_of_topic
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.endpoints import TopicInfo, topic_info

#: Latched messages of a topic, and what arrives while this program is busy.
_DEPTH = 1000
#: Topics that are recorded or refused. Any program of the domain can create more.
MAX_TOPICS = 1000
#: As of Gazebo and rosbag2.
_CLOCK_PERIOD_S = 0.01
#: How often a replay sees whether it is paused while it waits.
_PAUSE_PERIOD_S = 0.1
#: Seconds have 32 bits in messages.
_LATEST_S = 2**31 - 1


class GraphRecording:
    """Subscribes to the topics that ``is_wanted``, as soon as they have a publisher."""

    def __init__(
        self,
        session: Session,
        recorder: Recorder,
        is_wanted: Callable[[TopicInfo], bool],
        warn: Callable[[str], None],
    ) -> None:
        """``warn`` receives why a topic cannot be recorded, once."""
        self._session = session
        self._recorder = recorder
        self._is_wanted = is_wanted
        self._warn = warn
        self._interfaces = Interfaces.installed()
        self._subscriptions: dict[str, tuple[Subscription, QosProfile]] = {}
        self._refused: set[str] = set()
        self._is_limited = False

    @property
    def topics(self) -> int:
        """The number of topics with a subscription."""
        return len(self._subscriptions)

    def update(self) -> None:
        """Subscribe to new topics, and again where a publisher does not match."""
        for name, types in self._session.graph.topics():
            if is_hidden(owner_of_topic(name)[1]) or name in self._refused:
                continue
            is_new = name not in self._subscriptions
            if is_new and len(self._subscriptions) + len(self._refused) >= MAX_TOPICS:
                self._warn_of_limit()
                continue
            info = topic_info(self._session.graph.node, name, types)
            if info.publishers and self._is_wanted(info):
                self._subscribe(info, types)

    def close(self) -> None:
        """Destroy the subscriptions."""
        for subscription, _ in self._subscriptions.values():
            self._session.node.destroy_subscription(subscription)
        self._subscriptions.clear()

    def _subscribe(self, info: TopicInfo, types: tuple[str, ...]) -> None:
        offers = tuple(dict.fromkeys(publisher.qos for publisher in info.publishers))
        current = self._subscriptions.get(info.name)
        if current is not None:
            if not any(incompatibilities(offer, current[1]) for offer in offers):
                return
            self._session.node.destroy_subscription(current[0])
        if len(types) != 1:
            self._refuse(info.name, f"it has several types: {', '.join(types)}")
            return
        try:
            message_class = class_of(types[0])
        except InvalidValueError as error:
            self._refuse(info.name, str(error))
            return
        definition = full_definition(types[0], self._interfaces)
        # With the hash of a service event, the library rosbags cannot open the bag.
        type_hash = "" if "/srv/" in types[0] else info.publishers[0].type_hash
        topic = BagTopic(info.name, types[0], offers, definition, type_hash=type_hash)
        put = self._recorder.source(topic).put
        profile = strictest_compatible(list(offers), _DEPTH)
        subscription = self._session.node.create_subscription(
            message_class, info.name, partial(put), rclpy_profile(profile), raw=True
        )
        self._subscriptions[info.name] = (subscription, profile)

    def _warn_of_limit(self) -> None:
        if not self._is_limited:
            self._is_limited = True
            self._warn(f"there are more than {MAX_TOPICS:,} topics: no further ones are recorded")

    def _refuse(self, name: str, reason: str) -> None:
        self._refused.add(name)
        self._warn(f"'{name}' is not recorded: {reason}")


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """How a bag is replayed.

    ``rate`` is the speed; ``names`` replaces names of topics. With ``clock``, the time of the bag
    is published on /clock. While ``is_paused()``, no time passes.
    """

    rate: float = 1.0
    names: Mapping[str, str] = field(default_factory=dict)
    clock: bool = False
    is_paused: Callable[[], bool] = lambda: False


class GraphReplay:
    """Publishers of the topics of a bag, with the QoS profiles of the bag."""

    def __init__(
        self,
        session: Session,
        topics: Iterable[BagTopic],
        options: ReplayOptions,
        warn: Callable[[str], None],
    ) -> None:
        """``warn`` receives why a topic is not published. Raises BagError if none is."""
        self._session = session
        self._options = options
        self.count = 0
        #: The last time of time.monotonic, and how long the replay has run by then, without pauses.
        self._seen_s = self._passed_s = 0.0
        self._publishers: dict[str, TopicPublisher] = {}
        problems: list[BagError] = []
        for topic in topics:
            try:
                name = options.names.get(topic.name, topic.name)
                self._publishers[topic.name] = _publisher(session, name, topic)
            except BagError as error:
                problems.append(error)
        if problems and not self._publishers:
            raise problems[0]
        for problem in problems:
            warn(f"{problem}: it is not published")
        self._clock: Any = None
        if options.clock:
            self._clock = session.node.create_publisher(ClockMessage, "/clock", QoSProfile(depth=1))

    def wait_for_subscriptions(self, timeout_s: float) -> None:
        """Wait until discovery is complete: the first messages reach all subscriptions."""
        self._session.wait_until_settled(
            lambda: tuple(item.subscriptions for item in self._publishers.values()),
            Deadline(timeout_s),
        )

    def play(
        self, messages: Iterable[BagMessage], start_ns: int, on_message: Callable[[int], None]
    ) -> None:
        """Publish messages; ``start_ns`` is when the first may come. Raises BagError.

        ``on_message(recorded_ns)`` is called for each.
        """
        self._seen_s, self._passed_s = time.monotonic(), 0.0
        for message in messages:
            publisher = self._publishers.get(message.topic)
            if publisher is None:
                continue
            self._wait_until(message.recorded_ns, start_ns)
            publisher.publish(message.data)
            self.count += 1
            on_message(message.recorded_ns)

    def finish(self) -> bool:
        """Wait until reliable subscriptions have all messages, a second; return whether they do."""
        results = [item.wait_until_acknowledged() for item in self._publishers.values()]
        return all(results)

    def _wait_until(self, at_ns: int, start_ns: int) -> None:
        rate = self._options.rate
        due_s = (at_ns - start_ns) / NANOSECONDS / rate
        while True:
            is_paused = self._options.is_paused()
            now_s = time.monotonic()
            if not is_paused:
                self._passed_s += now_s - self._seen_s
            self._seen_s = now_s
            if not is_paused and self._passed_s >= due_s:
                break
            pause_s = _PAUSE_PERIOD_S if self._clock is None else _CLOCK_PERIOD_S
            if self._clock is not None:
                self._publish_time(start_ns + round(self._passed_s * rate * NANOSECONDS))
            if not is_paused:
                pause_s = min(pause_s, due_s - self._passed_s)
            self._session.spin_until(now_s + pause_s)
        if self._clock is not None:
            self._publish_time(at_ns)

    def _publish_time(self, at_ns: int) -> None:
        seconds, nanoseconds = divmod(at_ns, NANOSECONDS)
        if seconds > _LATEST_S:
            raise BagError("a message is from after 2038, which /clock cannot show")
        self._clock.publish(ClockMessage(clock=Time(sec=seconds, nanosec=nanoseconds)))


def _publisher(session: Session, name: str, topic: BagTopic) -> TopicPublisher:
    """Return a publisher of a topic, by another name. Raises BagError."""
    if topic.message_encoding != CDR:
        raise BagError(f"'{topic.name}' has messages in {topic.message_encoding}, not in {CDR}")
    try:
        return TopicPublisher(session, name, topic.type_name, offered(topic.qos))
    except InvalidNameError as error:
        raise BagError(str(error)) from error
    except InvalidValueError as error:
        raise BagError(f"'{topic.name}': {error}", error.hint) from error


def offered(profiles: Iterable[QosProfile]) -> QosProfile:
    """Return the profile that subscriptions to all recorded publishers match."""
    found = tuple(profiles)
    if len(set(found)) == 1:
        return found[0]
    if not found:
        return QosProfile()
    reliability, durability = strongest(found)
    depth = max(item.depth for item in found)
    return QosProfile(depth=depth, reliability=reliability, durability=durability)
