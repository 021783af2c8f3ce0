"""An action server whose cost does not grow with the number of goals that it has served."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from typing import Any

from rclpy.action.server import ActionServer

#: Ended goals whose status rcl keeps publishing, so that late subscribers see it.
KEPT_STATUSES = 10
#: Results that are kept for clients of other processes, and for how long, as by rclpy.
KEPT_RESULTS = 1000
RESULT_TIMEOUT_S = 900.0


class GoalServer(ActionServer):
    """rclpy's action server, with limits for what it keeps of ended goals.

    At each transition rcl publishes the status of all goals that it keeps, and clients turn the
    array into Python objects. With rclpy's result timeout of 15 minutes, goals take longer and
    longer. Here rcl keeps few ended goals, and results are kept apart from their statuses.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Create the server; the arguments are rclpy's, without ``result_timeout``."""
        # Zero: rcl discards ended goals on request.
        super().__init__(*arguments, result_timeout=0, **options)
        self._changing = threading.Lock()
        #: The ended goals that rcl keeps, and whether their result was delivered.
        self._ended: dict[bytes, bool] = {}
        #: The other ended goals, and when they ended.
        self._results: dict[bytes, float] = {}

    def end(self, identity: bytes, response: Any) -> None:
        """Send the result response of a goal that has succeeded, or was canceled or aborted."""
        with self._changing:
            self._ended[identity] = False
        future = self._result_futures[identity]
        future.set_result(response)
        super().remove_future(future)
        with self._changing:
            excess = len(self._ended) - KEPT_STATUSES
            if excess > 0:
                with self._lock:
                    expired = self._handle.expire_goals(excess)
                self._on_expired(expired)
            self._discard_old_results()

    def discard_result(self, identity: bytes) -> None:
        """Do not keep the result of an ended goal: the only client that may ask has it."""
        with self._changing:
            if identity in self._ended:
                self._ended[identity] = True
            elif self._results.pop(identity, None) is not None:
                self._discard(identity)

    def remove_future(self, future: Any) -> None:
        """Remove the future of a goal that has not ended: executors visit all futures."""
        if not future.done():
            super().remove_future(future)

    def _on_expired(self, infos: Iterable[Any]) -> None:
        for info in infos:
            identity = bytes(info.goal_id.uuid)
            if self._ended.pop(identity, False):
                self._discard(identity)
            else:
                self._results[identity] = time.monotonic()

    def _discard_old_results(self) -> None:
        oldest_s = time.monotonic() - RESULT_TIMEOUT_S
        for identity, ended_s in tuple(self._results.items()):
            if ended_s > oldest_s and len(self._results) <= KEPT_RESULTS:
                break
            del self._results[identity]
            self._discard(identity)

    def _discard(self, identity: bytes) -> None:
        # Only now: as long as rcl keeps a goal, it uses the memory of the handle.
        self._goal_handles.pop(identity).destroy()
        del self._result_futures[identity]
