"""What a recorder receives of nodes: messages, calls of services, goals, and transitions.

Calls and goals have the form of ROS 2's service introspection: a message on
``<service>/_service_event`` for each request and each response.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import isawaitable
from itertools import count
from typing import Any

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Time
from lifecycle_msgs.msg import TransitionDescription, TransitionEvent
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from service_msgs.msg import ServiceEventInfo
from unique_identifier_msgs.msg import UUID

from composer.model import Isolation, Port
from composer.model.qos import QosProfile
from composer.model.system import EVENT_TOPIC
from composer.runtime.clock import Clock
from composer.runtime.executors.sources import Reply
from composer.runtime.host_options import Recorder, Target
from composer.runtime.intra_process.topic import CopyingTarget

_SERVER = ServiceEventInfo.REQUEST_RECEIVED, ServiceEventInfo.RESPONSE_SENT
_CLIENT = ServiceEventInfo.REQUEST_SENT, ServiceEventInfo.RESPONSE_RECEIVED
#: rmw's profile of services, and rcl's of transition events.
_PROFILE = QosProfile(depth=10)
_NANOSECONDS = 1_000_000_000

Receive = Callable[[Any, Reply], None]
Respond = Callable[[Any], None]


def tap_of(
    recorder: Recorder | None, port: Port, topic: str, type_name: str, profile: QosProfile
) -> Target | None:
    """Return what records messages of a port; None if they are not recorded."""
    tap = None if recorder is None else recorder.tap(topic, type_name, profile)
    return CopyingTarget(tap) if tap is not None and port.isolation is Isolation.COPY else tap


def transition_tap(
    recorder: Recorder | None, node: str, clock: Clock
) -> Callable[[TransitionDescription], None] | None:
    """Return what records steps of the lifecycle of a node; None if they are not recorded."""
    topic, type_name = f"{node}/transition_event", "lifecycle_msgs/msg/TransitionEvent"
    target = None if recorder is None else recorder.tap(topic, type_name, _PROFILE)
    if target is None:
        return None

    def put(step: TransitionDescription) -> None:
        event = TransitionEvent(timestamp=clock.time_ns(), transition=step.transition)
        event.start_state, event.goal_state = step.start_state, step.goal_state
        target.put(event)

    return put


class CallTap:
    """Records the requests and responses of a service, by its server or by a client.

    Calls are numbered as they begin. The GID of the client is zero: a server does not know it.
    """

    def __init__(self, target: Target | None, event_type: Any, clock: Clock, *, is_client: bool):
        """Record nothing if ``target`` is None."""
        self._target = target
        self._event_type = event_type
        self._clock = clock
        self._kinds = _CLIENT if is_client else _SERVER
        self._numbers = count(1)

    @classmethod
    def of_port(
        cls,
        recorder: Recorder | None,
        port: Port,
        service_type: Any,
        clock: Clock,
        *,
        is_client: bool = False,
    ) -> CallTap:
        """Return the tap of a service port or a client port."""
        topic = f"{port.full_name}/{EVENT_TOPIC}"
        target = tap_of(recorder, port, topic, f"{port.interface.value}_Event", _PROFILE)
        return cls(target, service_type.Event, clock, is_client=is_client)

    def begin(self, request: Any) -> Respond:
        """Record a request; return what records the response to it."""
        number = next(self._numbers)
        self._put(self._kinds[0], number, request=[request])
        return lambda response: self._put(self._kinds[1], number, response=[response])

    def follow(self, request: Any, future: Any) -> Any:
        """Record a request of a client, and the response that is the result of ``future``."""
        if self._target is not None:
            respond = self.begin(request)

            def on_done(done: Any) -> None:
                if not done.cancelled() and done.exception() is None:
                    respond(done.result())

            future.add_done_callback(on_done)
        return future

    def recorded(self, receive: Receive) -> Receive:
        """Return the function that receives the requests of a server, so that it records."""
        if self._target is None:
            return receive
        return lambda request, reply: receive(request, _RecordedReply(reply, self.begin(request)))

    def _put(self, kind: int, number: int, **content: Any) -> None:
        if self._target is not None:
            info = ServiceEventInfo(event_type=kind, stamp=stamp(self._clock))
            info.sequence_number = number
            self._target.put(self._event_type(info=info, **content))


class _RecordedReply:
    """Ends one request, and records the response."""

    def __init__(self, reply: Reply, record: Respond) -> None:
        self._reply = reply
        self._record = record

    def __call__(self, response: Any) -> None:
        self._reply(response)
        self._record(response)

    def refuse(self, error: BaseException) -> None:
        self._reply.refuse(error)


class GoalTap:
    """Records the goals of an action server: requests, cancellations, feedback and results.

    The id of a goal that is rejected is zero: the callback that rejects it does not know the id.
    """

    def __init__(
        self, recorder: Recorder | None, port: Port, server: ActionServer, clock: Clock
    ) -> None:
        """Call it before the loop serves ``server``: it replaces the callbacks of the server."""
        self._server: Any = server
        self._clock = clock
        action = self._server.action_type
        type_name = port.interface.value
        self._feedback_type = action.Impl.FeedbackMessage
        topic = f"{port.full_name}/_action/feedback"
        self._feedback = tap_of(recorder, port, topic, f"{type_name}_FeedbackMessage", _PROFILE)
        if self._feedback is None:
            return

        def calls(name: str, service_type: Any, event_type: str) -> CallTap:
            topic = f"{port.full_name}/_action/{name}/{EVENT_TOPIC}"
            target = tap_of(recorder, port, topic, event_type, _PROFILE)
            return CallTap(target, service_type.Event, clock, is_client=False)

        self._goals = calls("send_goal", action.Impl.SendGoalService, f"{type_name}_SendGoal_Event")
        self._results = calls(
            "get_result", action.Impl.GetResultService, f"{type_name}_GetResult_Event"
        )
        self._cancellations = calls("cancel_goal", CancelGoal, "action_msgs/srv/CancelGoal_Event")
        self._decide = self._server._goal_callback
        self._cancel = self._server._cancel_callback
        self._accept = self._server._handle_accepted_callback
        server.register_goal_callback(self._on_goal)
        server.register_cancel_callback(self._on_cancel)
        server.register_handle_accepted_callback(self._on_accepted)

    def feedback(self, goal_id: UUID, feedback: Any) -> None:
        """Record feedback of a goal."""
        if self._feedback is not None:
            self._feedback.put(self._feedback_type(goal_id=goal_id, feedback=feedback))

    async def _on_goal(self, goal: Any) -> Any:
        answer = self._decide(goal)
        answer = await answer if isawaitable(answer) else answer
        if answer is not GoalResponse.ACCEPT:
            self._record_goal(UUID(), goal, accepted=False)
        return answer

    async def _on_accepted(self, handle: ServerGoalHandle) -> None:
        goal_id = handle.goal_id
        self._record_goal(goal_id, handle.request, accepted=True)
        request = self._server.action_type.Impl.GetResultService.Request(goal_id=goal_id)
        self._results.follow(request, self._server._result_futures[bytes(goal_id.uuid)])
        answer = self._accept(handle)
        if isawaitable(answer):
            await answer

    async def _on_cancel(self, handle: ServerGoalHandle) -> Any:
        info = GoalInfo(goal_id=handle.goal_id)
        respond = self._cancellations.begin(CancelGoal.Request(goal_info=info))
        answer = self._cancel(handle)
        answer = await answer if isawaitable(answer) else answer
        if answer is CancelResponse.ACCEPT:
            respond(CancelGoal.Response(goals_canceling=[info]))
        else:
            respond(CancelGoal.Response(return_code=CancelGoal.Response.ERROR_REJECTED))
        return answer

    def _record_goal(self, goal_id: UUID, goal: Any, *, accepted: bool) -> None:
        service = self._server.action_type.Impl.SendGoalService
        respond = self._goals.begin(service.Request(goal_id=goal_id, goal=goal))
        respond(service.Response(accepted=accepted, stamp=stamp(self._clock)))


def stamp(clock: Clock) -> Time:
    """Return the time of a clock as a message."""
    seconds, nanoseconds = divmod(clock.time_ns(), _NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)
