"""Which messages on the topic ``state`` are reports of a process of the system.

Any node can publish there, and a replayed bag does. So a report counts only if it is signed with
the key of the process: the one that it was started with, that in its instance lock or, on another
computer, the one that its service answers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from std_msgs.msg import String

from composer.runtime.members.context import MemberContext
from composer.runtime.members.lives import MemberLife
from composer.runtime.process.instance_lock import report_key
from composer.runtime.protocol.codec import ProtocolError, decode
from composer.runtime.protocol.reports import SystemReport, is_signed, split_signature
from composer.runtime.protocol.requests import NAME, STATE_TOPIC
from composer.runtime.ros.manager_interface import STATE_QOS


class MemberReports:
    """The subscription to the reports of a process. Use it on the loop of ``context``."""

    def __init__(
        self,
        name: str,
        context: MemberContext,
        on_message: Callable[[str], None],
        on_problem: Callable[[str], None],
    ) -> None:
        """``name`` is the namespace of the manager of the process.

        ``on_message(text)`` receives what may be a report, to pass it to :meth:`read`.
        ``on_problem(text)`` receives why reports cannot be read, once for each reason.
        """
        self._name = name
        self._context = context
        self._on_message = on_message
        self._on_problem = on_problem
        self._answered_key = ""  # of a process whose service was asked for it
        self._unsigned = ""  # the report for which it was asked
        self._problem = ""
        self._subscription = context.manager.create_subscription(
            String, f"{name}/{NAME}/{STATE_TOPIC}", lambda _: None, STATE_QOS
        )
        context.loop.add_subscription(self._subscription, self._on_taken)

    @property
    def missing(self) -> str:
        """Why there is no report, as far as it is known."""
        if self._problem:
            return self._problem
        is_there = self._context.manager.count_publishers(self._subscription.topic_name)
        return "its reports do not arrive" if is_there else "it is not in the ROS graph"

    def read(
        self, text: str, life: MemberLife | None, ask_for_key: Callable[[], None]
    ) -> tuple[SystemReport, str] | None:
        """Return the report in a message with the key that has signed it, None if it is none.

        ``life`` is the known life of the process. If it is on another computer, its service is
        asked for the key.
        """
        if life is not None and is_signed(text, life.report_key):
            return self._parsed(text, life.report_key)
        if life is not None and life.child is not None:
            return None
        key_here = report_key(self._name)
        key = self._answered_key if key_here is None else key_here
        if is_signed(text, key):
            return self._parsed(text, key)
        if key_here is None:
            self._unsigned = text
            ask_for_key()
        return None

    def on_key(self, key: str) -> None:
        """Use the key that the service has answered for the report for which it was asked."""
        self._answered_key = key
        self._on_message(self._unsigned)

    def close(self) -> None:
        """Destroy the subscription."""
        self._context.loop.remove(self._subscription)
        self._context.manager.destroy_subscription(self._subscription)

    def _on_taken(self, taken: tuple[String, Any]) -> None:
        self._on_message(taken[0].data)

    def _parsed(self, text: str, key: str) -> tuple[SystemReport, str] | None:
        try:
            return decode(split_signature(text)[1], SystemReport), key
        except ProtocolError as error:
            if str(error) != self._problem:
                self._problem = str(error)
                self._on_problem(f"reports what cannot be read: {error}")
            return None
