"""Services, actions and their clients that a class creates."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.action.server import CancelResponse, GoalEvent, GoalResponse, ServerGoalHandle
from rclpy.action.server import RCLError as ActionError
from rclpy.client import Client
from rclpy.node import Node
from rclpy.service import Service
from rclpy.task import Future as RclpyFuture

from composer.behavior import CallCancelled
from composer.model import Port, PortKind
from composer.runtime.executors.exceptions import is_closing
from composer.runtime.executors.futures import Cancelled, wrap_future
from composer.runtime.executors.strand import InlineStrand
from composer.runtime.executors.tasks import within
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.user_code import (
    UserFunction,
    call_in_group,
    interrupt_callbacks,
)
from composer.runtime.intra_process.taps import CallTap, GoalTap
from composer.runtime.ports import RunningPort
from composer.runtime.ports.action_server import CANCEL_LIMIT_S
from composer.runtime.ports.service import ServicePort


class HostedService(ServicePort):
    """A service port around rclpy's service, with the callback of the class."""

    def __init__(self, instance: Instance, service: Service) -> None:
        port = instance.ports.port(PortKind.SERVICE, service.service_name, service.srv_type)
        self._instance = instance
        self.port = port
        self._given: Any = service
        callback = UserFunction(instance, service.callback)
        context = instance.context_of(port, self._given)
        if is_reentrant(context):
            port = replace(port, reentrant=True)
        super().__init__(context, port, None, callback)

    def destroy(self) -> None:
        """Refuse the pending requests and destroy the service."""
        self._instance.ports.forget(self.port)
        super().destroy()

    def _interface(self, _port: Port) -> Any:
        return self._given.srv_type

    def _make_service(self, _port: Port) -> Service:
        return self._given  # type: ignore[no-any-return]

    def _destroy_service(self) -> None:
        Node.destroy_service(self._instance.node, self._given)


class HostedClient(Client):
    """The client that the class uses: rclpy's, whose class is replaced by this one.

    It calls in every transition and while the node is active.
    """

    _instance: Instance
    _tap: CallTap

    def call_async(self, request: Any) -> HostedFuture:
        """Send a request; the future fails with CallCancelled if the node is not active."""
        gate = self._instance.context.gate
        if not gate.waiting:
            return hosted_future(self._instance, CallCancelled(gate.refusal))
        future: Any = self._tap.follow(request, super().call_async(request))
        future.__class__ = HostedFuture
        future._instance = self._instance
        return future  # type: ignore[no-any-return]

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Send a request and wait for the response, or return None after ``timeout_sec``."""
        future = self.call_async(request)
        if not self._instance.wait_for(future, timeout_sec):
            self.remove_pending_request(future)
            return None
        return future.result()


class HostedFuture(RclpyFuture):
    """The future of a call: rclpy's, whose class is replaced by this one.

    Exceptions of its callbacks are errors of the node.
    """

    _instance: Instance

    def add_done_callback(self, callback: Callable[[Any], Any]) -> None:
        """Call ``callback(self)`` on the loop once the future is done."""
        function = UserFunction(self._instance, callback)
        context = self._instance.context

        def call(future: Any) -> None:
            rest = context.call(function.__name__, function, future)
            if rest is not None:
                context.spawn(rest)

        super().add_done_callback(call)


def hosted_future(instance: Instance, error: BaseException) -> HostedFuture:
    """Return a future that has failed with ``error``."""
    future = HostedFuture()
    future._instance = instance
    fail(future, error)
    return future


def fail(future: RclpyFuture, error: BaseException) -> None:
    """Fail a future. rclpy prints exceptions that are never retrieved; this one need not be."""
    future.set_exception(error)
    future.exception()


class ClientPort(RunningPort):
    """The port of a client: it fails the pending calls when the node leaves *active*."""

    def __init__(self, instance: Instance, client: Any) -> None:
        self._instance = instance
        self._client = client
        self.port = instance.ports.port(PortKind.CLIENT, client.service_name, client.srv_type)
        client.__class__ = HostedClient
        client._instance = instance
        context = instance.context
        client._tap = CallTap.of_port(
            context.router.recorder, self.port, client.srv_type, context.loop.clock, is_client=True
        )
        context.loop.add_client(client)

    def deactivate(self) -> None:
        """Fail the pending calls."""
        gate = self._instance.context.gate
        for future in tuple(self._client._pending_requests.values()):
            future._set_executor(self._instance.context.node.executor)
            fail(future, CallCancelled(gate.refusal))

    def destroy(self) -> None:
        """Fail the pending calls and destroy the client."""
        self._instance.ports.forget(self.port)
        self.deactivate()
        self._instance.context.loop.remove(self._client)
        Node.destroy_client(self._instance.node, self._client)


class HostedActionServer(RunningPort):
    """The port of an action server: it takes goals only while the node is active.

    When the node leaves *active*, running goals are asked to cancel, and feedback is dropped. Goals
    that have not ended at cleanup are aborted, so that their clients get a result.
    """

    def __init__(self, instance: Instance, server: Any, full_name: str) -> None:
        self._instance = instance
        self._server = server
        self.port = instance.ports.port(PortKind.ACTION_SERVER, full_name, server.action_type)
        self.name = self.port.name.value
        self._context = instance.context_for(server.callback_group, server)
        self._statistics = instance.context.statistics.callback(self.port.kind.value, self.name)
        goal = UserFunction(instance, server._goal_callback)
        server.register_goal_callback(self._in_group(goal, self._accepts))
        cancel = UserFunction(instance, server._cancel_callback)
        server.register_cancel_callback(self._in_group(cancel, _returns(CancelResponse.REJECT)))
        accepted = UserFunction(instance, server._handle_accepted_callback)
        server.register_handle_accepted_callback(self._in_group(accepted, self._abort_accepted))
        # As in rclpy, the execution of a goal belongs to no callback group.
        self._execution = UserFunction(instance, server._execute_callback)
        server.register_execute_callback(self._wrapped(self._execution, self._abort))
        context = instance.context
        self._tap = GoalTap(context.router.recorder, self.port, server, context.loop.clock)
        context.loop.add_action_server(server)

    def deactivate(self) -> None:
        """Ask the running goals to cancel."""
        for goal in tuple(self._server._goal_handles.values()):
            if goal.is_active and not goal.is_cancel_requested:
                try:
                    goal._update_state(GoalEvent.CANCEL_GOAL)
                except ActionError:
                    continue  # it has just ended

    async def drain(self) -> None:
        """Wait until the goals have ended, up to a time limit."""
        for goal in tuple(self._server._goal_handles.values()):
            result = self._server._result_futures.get(bytes(goal.goal_id.uuid))
            if result is None or not goal.is_active:
                continue
            try:
                await within(self._context.loop, wrap_future(result, cancels=False), CANCEL_LIMIT_S)
            except TimeoutError:
                self._context.log.warn(
                    f"action server '{self.name}': a goal did not end within {CANCEL_LIMIT_S:g} s"
                )
                interrupt_callbacks(self._instance, self._execution)

    def destroy(self) -> None:
        """Abort the goals that have not ended, and destroy the server."""
        self._instance.ports.forget(self.port)
        for identity, goal in tuple(self._server._goal_handles.items()):
            if goal.is_active:
                goal.abort()
                self._send_result(self._server._result_futures[identity], goal.status)
        self._context.loop.remove(self._server)
        self._server.destroy()

    def _send_result(self, future: Any, status: int) -> None:
        response = self._server.action_type.Impl.GetResultService.Response(status=status)
        future._set_executor(None)  # at once: the server is about to be destroyed
        future.set_result(response)

    # --- callbacks

    def _in_group(self, function: UserFunction, fallback: Callable[[Any], Any]) -> Any:
        wrapped = self._wrapped(function, fallback)
        strand = self._context.strand
        if isinstance(strand, InlineStrand):
            return wrapped

        async def call(argument: Any) -> Any:
            result = wrapped(argument)
            return await result if isinstance(result, Awaitable) else result

        async def call_in_group(argument: Any) -> Any:
            return await strand.wrap(call(argument))

        return call_in_group

    def _wrapped(self, function: UserFunction, fallback: Callable[[Any], Any]) -> Any:
        """Return a callback whose exceptions are errors of the node, answered by ``fallback``."""
        is_goal = fallback == self._accepts

        def call(argument: Any) -> Any:
            if is_goal and not self._context.gate.incoming:
                return self._accepts(argument)
            if isinstance(argument, ServerGoalHandle):
                self._gate(argument)
            try:
                return function(argument)
            except BaseException as error:
                return self._fail(function, error, fallback, argument)

        async def call_and_await(argument: Any) -> Any:
            try:
                result = call(argument)
                return await result if isinstance(result, Awaitable) else result
            except BaseException as error:
                if is_closing(error):
                    raise
                return self._fail(function, error, fallback, argument)

        return call_and_await if function.is_async else call

    def _fail(
        self,
        function: UserFunction,
        error: BaseException,
        fallback: Callable[[Any], Any],
        argument: Any,
    ) -> Any:
        if not isinstance(error, Cancelled):
            self._context.error_log.exception(function.__name__, error)
        return fallback(argument)

    def _accepts(self, _: object) -> GoalResponse:
        if not self._context.gate.incoming:
            self._context.log.info(
                f"action server '{self.name}' rejects a goal: {self._context.gate.refusal}"
            )
        return GoalResponse.REJECT

    def _gate(self, goal: Any) -> None:
        """Make a goal publish feedback only while the node is active."""
        if "publish_feedback" in vars(goal):
            return  # it was given to another callback before
        publish = goal.publish_feedback

        def publish_feedback(feedback: Any) -> None:
            if self._context.gate.outgoing:
                publish(feedback)
                self._tap.feedback(goal.goal_id, feedback)

        goal.publish_feedback = publish_feedback

    def _abort(self, goal: Any) -> Any:
        if goal.is_active:
            goal.abort()
        return self._server.action_type.Result()

    def _abort_accepted(self, goal: Any) -> None:
        goal.execute(self._abort)


class HostedActionClient(RunningPort):
    """The port of an action client. Its goals go by DDS, while the node is active."""

    def __init__(self, instance: Instance, client: Any, full_name: str) -> None:
        self._instance = instance
        self._client = client
        self.port = instance.ports.port(PortKind.ACTION_CLIENT, full_name, client._action_type)
        self._context = instance.context_for(self._client.callback_group, client)
        self._send = self._client.send_goal_async
        self._client.send_goal_async = self._send_goal
        instance.context.loop.add_action_client(client)

    def destroy(self) -> None:
        """Destroy the client."""
        self._instance.ports.forget(self.port)
        self._instance.context.loop.remove(self._client)
        self._client.destroy()

    def _send_goal(
        self, goal: Any, feedback_callback: Callable[[Any], Any] | None = None, **options: Any
    ) -> Any:
        """Send a goal as rclpy's method; it fails with CallCancelled if the node is not active."""
        context = self._instance.context
        if not context.gate.waiting:
            return hosted_future(self._instance, CallCancelled(context.gate.refusal))
        if feedback_callback is not None:
            function = UserFunction(self._instance, feedback_callback)
            feedback_callback = partial(call_in_group, self._context, function)
        return self._send(goal, feedback_callback, **options)


def _returns(value: Any) -> Callable[[object], Any]:
    return lambda _: value
