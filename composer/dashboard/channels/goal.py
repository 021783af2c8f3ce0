"""``goal``: a goal that is sent to an action, its feedback and its result."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import RequestError, Values, from_ros, json_safe, to_json
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.client.calls import FinishedGoal
    from composer.dashboard.ros_side import RosGraphSide

_ACCEPTED_WITHIN_S = 5.0
_MAX_ITEMS = 256
#: Goals of all browsers together; each has a thread of its own, as it may take minutes.
_SLOTS = threading.BoundedSemaphore(16)


class GoalFeed(Feed):
    """One goal. Without its subscriber it goes on, unobserved."""

    delivery = Delivery.QUEUE
    is_shared = False
    changes = True
    period_s = 0.1

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        del declared
        self._action = values.text("action")
        self._type = values.optional_text("type")
        self._goal = values.mapping("goal")
        values.end()
        self._ros: RosGraphSide
        self._thread: threading.Thread | None = None
        self._is_open = True
        self._is_canceled = False
        self._updates: deque[Update] = deque()
        self._feedback: Any = None

    def start(self, ros: RosGraphSide) -> None:
        """Send the goal, once. Raises RequestError."""
        if self._thread is not None:
            return
        if not _SLOTS.acquire(blocking=False):
            raise RequestError("busy", "too many goals are observed at once")
        self._ros = ros
        self._thread = threading.Thread(target=self._run, name="goal", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Request that the goal is canceled."""
        self._is_canceled = True

    def close(self) -> None:
        """Stop observing the goal."""
        self._is_open = False

    def poll(self) -> Iterator[Update]:
        """Yield what has happened; of several feedback messages the last one."""
        feedback, self._feedback = self._feedback, None
        if feedback is not None and not any(update.ended for update in self._updates):
            self._add({"status": "executing", "feedback": self._shown(feedback)})
        while self._updates:
            yield self._updates.popleft()

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
        from composer.client.graph_names import GraphNames
        from composer.client.name_matching import full_name
        from composer.client.session import Deadline

        deadline = Deadline(_ACCEPTED_WITHIN_S)
        session = self._ros.session
        action = full_name("action", self._action)
        type_name = self._type or GraphNames(session, deadline).only_type("action", action)
        request = GoalRequest(
            action,
            type_name,
            self._ros.forms.from_json(self._goal, type_name, "goal"),
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
