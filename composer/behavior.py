"""What Python behaviours are written against. Nothing here needs ROS.

A behaviour is a plain class beside its node type. Handlers bind by name::

    class Planner(Behavior):
        def on_sensor_data(self, message): ...              # subscription `sensor_data`
        def on_tick(self): ...                               # timer `tick`
        def on_plan_trajectory(self, request, response): ... # service; returns the response
        async def on_navigate(self, goal): ...               # action server; returns the result
        def accept_navigate(self, request) -> bool: ...      # optional: which goals are taken
        def on_parameters(self, changes): ...                # optional: after a run-time change
        def on_configure(self): ...                          # and on_activate, on_deactivate,
                                                             # on_cleanup, on_shutdown, on_error

What a handler receives is shared with others and is not to be changed, nor is what was published.

Every handler may be ``async def``. Lifecycle handlers return nothing; raising makes the
transition fail: :class:`TransitionFailed` refuses it (the node stays where it was), any other
exception is an error (the node's ``on_error`` runs with it, and the node is unconfigured after).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Protocol


class BehaviorError(Exception):
    """Base of everything a behaviour may catch from the composer."""


class TransitionFailed(BehaviorError):
    """Raised by a lifecycle handler to refuse the transition."""


class CallError(BehaviorError):
    """A service call or an action goal that came to nothing."""


class ServerUnavailable(CallError):
    """No server was there within the timeout."""


class CallTimeout(CallError):
    """The server did not answer within the timeout."""


class CallCancelled(CallError):
    """The node that called left the active state before the answer came."""


class GoalRejected(CallError):
    """The action server did not take the goal."""


class Publisher(Protocol):
    """A publisher port. What is published while the node is not active is dropped and counted."""

    def publish(self, message: Any) -> None:
        """Send ``message``. It must not be changed afterwards: receivers get this very object."""

    @property
    def message_type(self) -> Any:
        """The message class of the topic."""


class Client(Protocol):
    """A service client port."""

    def call(self, request: Any, *, timeout_ms: float | None = None) -> Awaitable[Any]:
        """Wait for the server and its answer, both within the timeout (the port's unless given).

        Raises ServerUnavailable, CallTimeout, CallCancelled.
        """

    @property
    def service_type(self) -> Any:
        """The service class; ``service_type.Request`` is what to send."""


class SentGoal(Protocol):
    """A goal that an action server took."""

    def result(self, *, timeout_ms: float | None = None) -> Awaitable[GoalResult]:
        """Wait for the end of the goal. Raises CallTimeout, CallCancelled."""

    def cancel(self) -> Awaitable[bool]:
        """Ask the server to cancel; true when it agreed."""


class GoalResult(Protocol):
    """How a goal ended: ``status`` is ``succeeded``, ``canceled`` or ``aborted``."""

    @property
    def status(self) -> str:
        """The end state, as action_msgs/msg/GoalStatus spells it, in lower case."""

    @property
    def result(self) -> Any:
        """The action's result message."""


class ActionClient(Protocol):
    """An action client port."""

    def send_goal(
        self,
        goal: Any,
        *,
        on_feedback: Callable[[Any], None] | None = None,
        timeout_ms: float | None = None,
    ) -> Awaitable[SentGoal]:
        """Wait for the server and its word on the goal.

        Raises ServerUnavailable, CallTimeout, CallCancelled, GoalRejected.
        """

    @property
    def action_type(self) -> Any:
        """The action class; ``action_type.Goal`` is what to send."""


class Goal(Protocol):
    """A goal being worked on, as an action server's handler gets it.

    A handler that returns without naming the end has succeeded, or is canceled when that was asked
    for; one that raises has aborted.
    """

    @property
    def request(self) -> Any:
        """The goal message."""

    @property
    def is_cancel_requested(self) -> bool:
        """True once the client asked for the end, or the node is leaving the active state."""

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the client."""

    def succeed(self) -> None:
        """End the goal as succeeded."""

    def abort(self) -> None:
        """End the goal as aborted."""

    def canceled(self) -> None:
        """End the goal as canceled."""


class Logger(Protocol):
    """The node's logger: to the terminal and to /rosout."""

    def debug(self, message: str) -> None:
        """Log for whoever looks for a fault."""

    def info(self, message: str) -> None:
        """Log what a person running the system wants to see."""

    def warn(self, message: str) -> None:
        """Log what may be wrong."""

    def error(self, message: str) -> None:
        """Log what is wrong."""

    def fatal(self, message: str) -> None:
        """Log what ends the node."""


class Clock(Protocol):
    """The node's clock."""

    def now(self) -> float:
        """Return the time in seconds."""

    def stamp(self) -> Any:
        """Return the time as a builtin_interfaces/msg/Time, for message headers."""

    def sleep(self, seconds: float) -> Awaitable[None]:
        """Let other callbacks run for so long. Raises CallCancelled when the node leaves active."""


class Behavior:
    """Base of behaviours: names what the composer sets before ``on_configure``.

    In a test without ROS, set the attributes a handler uses to whatever stands in for them.
    """

    # Slots are in the object, where a message finds them at once. Whatever else may be set as well.
    __slots__ = (
        "__dict__",
        "__weakref__",
        "action_clients",
        "clients",
        "clock",
        "log",
        "name",
        "parameters",
        "publishers",
    )

    name: str
    parameters: Any  # self.parameters.max_velocity: the value now
    publishers: Any  # self.publishers.motor_commands: a Publisher
    clients: Any  # self.clients.plan_trajectory: a Client
    action_clients: Any  # self.action_clients.navigate: an ActionClient
    log: Logger
    clock: Clock


Changes = Mapping[str, Any]
