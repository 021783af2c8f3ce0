"""``publishing`` repeats a message while it is subscribed to; ``goal`` sends a goal."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.context import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import RequestError, Values, from_ros, json_safe, to_json
from composer.dashboard.protocol.outbox import Delivery, Update
from composer.model import PortKind
from composer.model.qos import PRESETS, Durability, QosProfile, incompatibilities

if TYPE_CHECKING:
    from composer.client.calls import FinishedGoal
    from composer.client.messages.topics import TopicPublisher
    from composer.dashboard.observing.ros_graph import RosGraph
    from composer.plan.drift import ObservedEndpoint

_REPORT_PERIOD_S = 0.5
_ACCEPTED_WITHIN_S = 5.0
_MAX_ITEMS = 256
#: Goals of all browsers together; each has a thread of its own, as it may take minutes.
_SLOTS = threading.BoundedSemaphore(16)


class Outgoing:
    """A message with its publisher, once it is open."""

    def __init__(self, values: Values) -> None:
        """Read the message that a request describes. Raises RequestError."""
        self.topic, self.type_name = values.text("topic"), values.text("type")
        self._values = values.mapping("message")
        self._ros: RosGraph
        self._message: Any = None
        self.publisher: TopicPublisher

    def open(self, ros: RosGraph) -> TopicPublisher:
        """Create the publisher, and return it. Raises RosError, RequestError."""
        from composer.client.graph_names import full_name
        from composer.client.messages.topics import TopicPublisher
        from composer.client.messages.values import build_message, class_of

        self._ros = ros
        message_class = class_of(self.type_name)
        values = ros.forms.from_json(self._values, self.type_name, "message")
        self._message = build_message(values, message_class, "the message")
        topic = self.topic = full_name("topic", self.topic)
        profile = suitable_profile(ros, topic)
        self.publisher = TopicPublisher(ros.session, topic, self.type_name, profile)
        return self.publisher

    def expected(self) -> int:
        """Return the number of known subscriptions that the publisher will match."""
        profile = suitable_profile(self._ros, self.topic)
        ends = _subscriptions(self._ros, self.topic)
        return sum(end.qos is None or not incompatibilities(profile, end.qos) for end in ends)

    def publish(self) -> None:
        """Publish the message once."""
        self.publisher.publish(self._message)


def suitable_profile(ros: RosGraph, topic: str) -> QosProfile:
    """Return a profile for a publisher: latched if a subscription to the topic requests that."""
    is_latched = any(
        end.qos is not None and end.qos.durability is Durability.TRANSIENT_LOCAL
        for end in _subscriptions(ros, topic)
    )
    return PRESETS["state" if is_latched else "command"]


def _subscriptions(ros: RosGraph, topic: str) -> list[ObservedEndpoint]:
    ends = ros.known().of_topics.get(topic, [])
    return [end for _, end in ends if end.kind is PortKind.SUBSCRIPTION]


class PublishingFeed(Feed):
    """A publisher that repeats one message."""

    is_shared = False
    changes = True

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._outgoing = Outgoing(values)
        self.period_s = 1.0 / values.number("rate_hz", 1.0, 0.01, 100.0)
        self._count = 0
        self._reported_s = 0.0

    def start(self) -> None:
        """Create the publisher. Raises RosError."""
        self.resources.callback(self._outgoing.open(self.ros).close)

    def poll(self) -> Iterator[Update]:
        """Publish, and yield the count from time to time."""
        self._outgoing.publish()
        self._count += 1
        now_s = time.monotonic()
        if now_s >= self._reported_s + _REPORT_PERIOD_S:
            self._reported_s = now_s
            data = {"count": self._count, "subscriptions": self._outgoing.publisher.subscriptions}
            yield Update(to_json(data))


class GoalFeed(Feed):
    """One goal. Without its subscriber it goes on, unobserved."""

    delivery = Delivery.QUEUE
    is_shared = False
    changes = True
    period_s = 0.1

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._action = values.text("action")
        self._type = values.text("type")
        self._goal = values.mapping("goal")
        self._thread: threading.Thread | None = None
        self._is_open = True
        self._is_canceled = False
        self._updates: deque[Update] = deque()
        self._feedback: Any = None

    def start(self) -> None:
        """Send the goal, once. Raises RequestError."""
        self.resources.callback(self._forget)
        if self._thread is not None:
            return
        if not _SLOTS.acquire(blocking=False):
            raise RequestError("busy", "too many goals are observed at once")
        self._thread = threading.Thread(target=self._run, name="goal", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Request that the goal is canceled."""
        self._is_canceled = True

    def poll(self) -> Iterator[Update]:
        """Yield what has happened; of several feedback messages the last one."""
        feedback, self._feedback = self._feedback, None
        if feedback is not None and not any(update.ended for update in self._updates):
            self._add({"status": "executing", "feedback": self._shown(feedback)})
        while self._updates:
            yield self._updates.popleft()

    def _forget(self) -> None:
        self._is_open = False

    def _run(self) -> None:
        from composer.client.session import RosError

        try:
            finished = self._observe()
            if finished is not None:
                data = {"status": finished.status, "result": self._shown(finished.result)}
                self._add(data, ended=True)
        except RosError as error:
            self._fail(from_ros(error))
        except RequestError as error:
            self._fail(error)
        except Exception as error:  # the browser gets an answer in any case
            self._fail(RequestError("internal", f"the goal failed: {error!r:.200}"))
        finally:
            _SLOTS.release()

    def _observe(self) -> FinishedGoal | None:
        """Send the goal and wait for its end; None if nothing observes it any more."""
        from composer.client.calls import GoalRequest, send_goal
        from composer.client.graph_names import full_name
        from composer.client.session import Deadline

        deadline = Deadline(_ACCEPTED_WITHIN_S)
        session = self.ros.session
        action = full_name("action", self._action)
        request = GoalRequest(
            action,
            self._type,
            self.ros.forms.from_json(self._goal, self._type, "goal"),
            self._on_feedback,
            lambda: False,
        )
        with send_goal(session, deadline, request) as accepted:
            self._add({"status": "accepted"})
            finished = accepted.result(lambda: self._is_canceled or not self._is_open)
            if finished is None and self._is_canceled:
                return accepted.cancel()
            return finished

    def _on_feedback(self, feedback: Any) -> None:
        self._feedback = feedback

    def _shown(self, message: Any) -> Any:
        from composer.client.messages.values import to_short_plain

        return json_safe(to_short_plain(message, _MAX_ITEMS))

    def _add(self, data: dict[str, Any], *, ended: bool = False) -> None:
        self._updates.append(Update(to_json(data), ended=ended))

    def _fail(self, error: RequestError) -> None:
        self._updates.append(Update(to_json(error.as_data()), is_error=True, ended=True))
