"""Records topics of the ROS graph, by subscriptions whose QoS matches their publishers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rclpy.subscription import Subscription

from composer.bags.bag import BagTopic
from composer.bags.definitions import full_definition
from composer.bags.recorder import Recorder
from composer.client.messages.values import InvalidValueError, class_of
from composer.client.session import Session
from composer.interfaces import Interfaces
from composer.model.names import is_hidden
from composer.model.qos import QosProfile, incompatibilities, strictest_compatible
from composer.model.system import owner_of_topic
from composer.runtime.ros.qos_profiles import rclpy_profile
from composer.runtime.ros_graph.endpoints import TopicInfo

#: Latched messages of a topic, and what arrives while this program is busy.
_DEPTH = 1000
#: Topics that are recorded or refused. Any program of the domain can create more.
MAX_TOPICS = 1000


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
            info = self._session.graph.topic(name, types)
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
