"""The API for Python behaviors. It does not need ROS.

A behavior is a plain class next to its node type. Handlers are bound by name::

    class Planner(Behavior):
        def on_sensor_data(self, message): ...              # subscription `sensor_data`
        def on_tick(self): ...                               # timer `tick`
        def on_plan_trajectory(self, request, response): ... # service; returns the response
        async def on_navigate(self, goal): ...               # action server; returns the result
        def accept_navigate(self, request) -> bool: ...      # optional: which goals to accept
        def on_parameters(self, changes): ...                # optional: after a run-time change
        def on_configure(self): ...                          # and on_activate, on_deactivate,
                                                             # on_cleanup, on_shutdown, on_error

Messages that a handler receives or has published are shared: do not change them.

``from composer.typed import PlannerBehavior`` in place of :class:`Behavior` gives editors and type
checkers the types of the ports and parameters of node type ``planner``, as written
by ``compose stubs``.

Every handler may be ``async def``. Lifecycle handlers return nothing. An exception makes the
transition fail: :class:`TransitionFailed` refuses it, and the node keeps its state; any other
exception is an error, which calls the node's ``on_error`` and leaves the node unconfigured.
``self.fail(reason)`` in any handler reports that the node has failed.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import Transform, TransformStamped
    from rclpy.node import Node

M = TypeVar("M")
Req = TypeVar("Req", contravariant=True)
Res = TypeVar("Res", covariant=True)
G = TypeVar("G", contravariant=True)
R = TypeVar("R", covariant=True)
F = TypeVar("F", contravariant=True)
Request = TypeVar("Request", covariant=True)
Feedback = TypeVar("Feedback", covariant=True)


class BehaviorError(Exception):
    """Base class of the exceptions for behaviors."""


class TransitionFailed(BehaviorError):
    """Raised by a lifecycle handler to refuse the transition."""


class CallError(BehaviorError):
    """A service call or an action goal failed."""


class ServerUnavailable(CallError):
    """No server was available within the timeout, or its node is not active."""


class CallTimeout(CallError):
    """The server did not respond within the timeout."""


class CallCancelled(CallError):
    """The calling node left the active state before the response arrived."""


class GoalRejected(CallError):
    """The action server rejected the goal."""


class TransformError(BehaviorError):
    """A transform between two frames is not available."""


class TransformLookupError(TransformError):
    """A frame is not known: nothing has broadcast it yet."""


class TransformConnectivityError(TransformError):
    """Two frames are in different trees."""


class TransformExtrapolationError(TransformError):
    """The time is earlier or later than the transforms that were received."""


class Publisher(Protocol[M]):
    """A publisher port. Messages published while the node is inactive are dropped and counted."""

    def publish(self, message: M) -> None:
        """Publish ``message``. Do not change it afterwards: receivers share the object."""

    @property
    def message_type(self) -> type[M]:
        """The message class of the topic."""


class Client(Protocol[Req, Res]):
    """A service client port."""

    def call(self, request: Req, *, timeout_ms: float | None = None) -> Coroutine[Any, Any, Res]:
        """Call the service; wait for server and response up to the timeout (default: the port's).

        Raises ServerUnavailable, CallTimeout, CallCancelled.
        """

    @property
    def service_type(self) -> Any:
        """The service class; ``service_type.Request`` is the request class."""


class SentGoal(Protocol[R]):
    """A goal that an action server accepted."""

    def result(self, *, timeout_ms: float | None = None) -> Coroutine[Any, Any, GoalResult[R]]:
        """Wait for the result of the goal. Raises CallTimeout, CallCancelled."""

    def cancel(self) -> Coroutine[Any, Any, bool]:
        """Request to cancel the goal; true if the server accepts."""


class GoalResult(Protocol[R]):
    """The result of a goal; ``status`` is ``succeeded``, ``canceled`` or ``aborted``."""

    @property
    def status(self) -> str:
        """The final status, as in action_msgs/msg/GoalStatus but in lower case."""

    @property
    def result(self) -> R:
        """The action's result message."""


class ActionClient(Protocol[G, R, Feedback]):
    """An action client port."""

    def send_goal(
        self,
        goal: G,
        *,
        on_feedback: Callable[[Feedback], object] | None = None,
        timeout_ms: float | None = None,
    ) -> Coroutine[Any, Any, SentGoal[R]]:
        """Send a goal, and wait until the server accepts or rejects it.

        Raises ServerUnavailable, CallTimeout, CallCancelled, GoalRejected.
        """

    @property
    def action_type(self) -> Any:
        """The action class; ``action_type.Goal`` is the goal class."""


class Goal(Protocol[Request, F]):
    """A goal that an action server's handler executes.

    If the handler returns without a final status, the goal succeeds, or is canceled if that was
    requested. If it raises, the goal is aborted.
    """

    @property
    def request(self) -> Request:
        """The goal message."""

    @property
    def is_cancel_requested(self) -> bool:
        """True if the client requested to cancel, or the node is leaving the active state."""

    def publish_feedback(self, feedback: F) -> None:
        """Publish feedback to the client."""

    def succeed(self) -> None:
        """End the goal as succeeded."""

    def abort(self) -> None:
        """End the goal as aborted."""

    def canceled(self) -> None:
        """End the goal as canceled."""


class Logger(Protocol):
    """The node's logger, for the terminal and /rosout."""

    def debug(self, message: str) -> None:
        """Log a debug message."""

    def info(self, message: str) -> None:
        """Log an informational message."""

    def warn(self, message: str) -> None:
        """Log a warning."""

    def error(self, message: str) -> None:
        """Log an error."""

    def fatal(self, message: str) -> None:
        """Log a fatal error."""


class Fail(Protocol):
    """Reports that the node has failed, from any handler or thread."""

    def __call__(self, reason: str) -> None:
        """Let the `on_failure` of the node apply, and return.

        During a transition, the transition ends in an error. Messages and the state of the node do
        not change before the handler returns.
        """


class Clock(Protocol):
    """The node's clock."""

    def now(self) -> float:
        """Return the time in seconds."""

    def stamp(self) -> Time:
        """Return the time as a builtin_interfaces/msg/Time, for message headers."""

    def sleep(self, seconds: float) -> Coroutine[Any, Any, None]:
        """Sleep without blocking. Raises CallCancelled if the node leaves the active state."""


class Transforms(Protocol):
    """The frames of tf2, for a node with `transforms`.

    A transform is a geometry_msgs/msg/TransformStamped. It maps coordinates in the frame
    ``source`` to coordinates in the frame ``target``. A ``stamp`` is a builtin_interfaces/msg/Time,
    as in the header of a message. Without it, or with zero as in tf2, the lookup uses the latest
    time at which every transform between the frames is available. Between two received transforms,
    values are interpolated.
    """

    def lookup(self, target: str, source: str, *, stamp: Time | None = None) -> TransformStamped:
        """Return the transform from ``source`` to ``target``, a TransformStamped.

        Raises TransformLookupError, TransformConnectivityError, TransformExtrapolationError.
        """

    def wait(
        self, target: str, source: str, *, stamp: Time | None = None, timeout_ms: float = 5000.0
    ) -> Coroutine[Any, Any, TransformStamped]:
        """Wait for a transform up to the timeout, in real time, and return it.

        Raises what ``lookup`` raises when the time is over, and CallCancelled.
        """

    def can_lookup(self, target: str, source: str, *, stamp: Time | None = None) -> bool:
        """Return whether ``lookup`` would return a transform now."""

    def transform(self, message: M, target: str) -> M:
        """Return a message of geometry_msgs in another frame, at the time of its header.

        The message is a PointStamped, Vector3Stamped, QuaternionStamped or PoseStamped; a vector is
        only rotated. Raises what ``lookup`` raises, and TypeError for other messages.
        """

    def broadcast(self, child: str, transform: Transform, *, stamp: Time | None = None) -> None:
        """Broadcast the transform from a declared frame to its parent.

        ``transform`` is a geometry_msgs/msg/Transform; by default, ``stamp`` is the current time.
        The frame is declared in `static` with `from_code`, or in `dynamic` without `from`; that
        determines the topic. Raises ValueError for another frame, or a rotation that is not
        a unit quaternion.
        """


class Behavior:
    """Base class of behaviors: the attributes that the composer sets before ``on_configure``.

    :class:`composer.testing.BehaviorTest` sets them in a test.
    """

    # Slots are faster to access than the dict, which subclasses use for their own attributes.
    __slots__ = (
        "__dict__",
        "__weakref__",
        "action_clients",
        "clients",
        "clock",
        "fail",
        "log",
        "name",
        "node",
        "parameters",
        "publishers",
        "transforms",
    )

    name: str
    parameters: Any  # self.parameters.max_velocity: the current value
    publishers: Any  # self.publishers.motor_commands: a Publisher
    clients: Any  # self.clients.plan_trajectory: a Client
    action_clients: Any  # self.action_clients.navigate: an ActionClient
    log: Logger
    clock: Clock
    transforms: Transforms  # only if the node has `transforms`
    fail: Fail  # self.fail("no device"): `on_failure` of the node applies
    node: Node  # an rclpy Node for libraries that need one; what it creates follows the lifecycle


Changes = Mapping[str, Any]
