"""Action servers and their clients that a class creates."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from rclpy.action.server import CancelResponse, GoalEvent, GoalResponse, ServerGoalHandle
from rclpy.action.server import RCLError as ActionError

from composer.behavior import CallCancelled
from composer.model import PortKind
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.strand import InlineStrand
from composer.runtime.executors.tasks import wait_for
from composer.runtime.executors.tracebacks import is_closing
from composer.runtime.hosting.instance import Instance
from composer.runtime.hosting.ports.services import ServerInProcess, hosted_future
from composer.runtime.hosting.user_code import UserFunction, call_in_group, interrupt_callbacks
from composer.runtime.intra_process.servers import LocalActionServer, LocalGoal, new_goal_id
from composer.runtime.intra_process.taps import GoalTap
from composer.runtime.ports import RunningPort
from composer.runtime.ports.goals import CANCEL_LIMIT_S


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
        self._context = instance.context_for(server.callback_group)
        self._statistics = instance.context.statistics.callback(self.port.kind.value, self.name)
        loop, router = instance.context.loop, instance.context.router
        self._local = LocalActionServer(self.port, server, loop.run_task)
        goal = instance.function(server._goal_callback, server, self._context)
        server.register_goal_callback(self._in_group(goal, self._accepts))
        cancel = instance.function(server._cancel_callback, server, self._context)
        server.register_cancel_callback(self._in_group(cancel, lambda _: CancelResponse.REJECT))
        accepted = instance.function(server._handle_accepted_callback, server, self._context)
        server.register_handle_accepted_callback(self._in_group(accepted, self._abort_accepted))
        # As in rclpy, the execution of a goal belongs to no callback group.
        self._execution = UserFunction(instance, server._execute_callback)
        server.register_execute_callback(self._wrapped(self._execution, self._abort))
        self._tap = GoalTap(router.recorder, self.port, server, loop.clock)
        loop.add_action_server(server)
        #: Ends the offer to clients of the process.
        self.withdraw = router.add_action_server(self.port, self._local)

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
            if not await wait_for(self._context.loop, result, CANCEL_LIMIT_S):
                self._context.log.warn(
                    f"action server '{self.name}': a goal did not end within {CANCEL_LIMIT_S:g} s"
                )
                interrupt_callbacks(self._instance, self._execution)

    def destroy(self) -> None:
        """Abort the goals that have not ended, and destroy the server."""
        self.withdraw()
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
                self._local.publish_feedback(bytes(goal.goal_id.uuid), feedback)

        goal.publish_feedback = publish_feedback

    def _abort(self, goal: Any) -> Any:
        if goal.is_active:
            goal.abort()
        return self._server.action_type.Result()

    def _abort_accepted(self, goal: Any) -> None:
        goal.execute(self._abort)


class HostedActionClient(RunningPort):
    """The port of an action client, which sends goals while the node is active."""

    def __init__(self, instance: Instance, client: Any, full_name: str) -> None:
        self._instance = instance
        self._client = client
        self.port = instance.ports.port(PortKind.ACTION_CLIENT, full_name, client._action_type)
        self._context = instance.context_for(self._client.callback_group)
        loop, router = instance.context.loop, instance.context.router
        self._send = self._client.send_goal_async
        self._client.send_goal_async = self._send_goal
        # rclpy's own functions would block the loop.
        self._client.send_goal = self._send_goal_and_wait
        self._client._get_result = self._waiting(self._client._get_result_async)
        self._client._cancel_goal = self._waiting(self._client._cancel_goal_async)
        self._client.wait_for_server = self._wait_for_server
        self._client._generate_random_uuid = new_goal_id
        loop.add_action_client(client)
        find = router.action_server_lookup(self.port)
        self._client._client_handle = GoalRequests(
            client, ServerInProcess(self._context, self.port, find), loop.action_receiver(client)
        )

    def destroy(self) -> None:
        """Destroy the client."""
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
            function = self._instance.function(feedback_callback, self._client, self._context)
            feedback_callback = partial(call_in_group, self._context, function)
        return self._send(goal, feedback_callback, **options)

    def _waiting(self, send: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that sends something and waits for the response."""

        def send_and_wait(*arguments: Any, **options: Any) -> Any:
            future = send(*arguments, **options)
            self._instance.wait_for(future, None)
            return future.result()

        return send_and_wait

    def _send_goal_and_wait(self, goal: Any, **options: Any) -> Any:
        handle = self._waiting(self._send_goal)(goal, **options)
        return self._client._get_result(handle)

    def _wait_for_server(self, timeout_sec: float | None = None) -> bool:
        return self._instance.wait_for_server(self._client.server_is_ready, timeout_sec)


class GoalRequests:
    """Takes the place of rcl's action client: requests to a server of the process stay there."""

    def __init__(
        self,
        client: Any,
        server: ServerInProcess[LocalActionServer],
        receive: Callable[[dict[str, Any]], None],
    ) -> None:
        """``receive`` gets what rclpy's client takes from rcl, by the kind of response."""
        self._rcl = client._client_handle
        self._types = client._action_type.Impl
        self._server = server
        self._receive = receive

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rcl, name)

    def is_action_server_available(self) -> bool:
        """Return whether there is a server."""
        return self._server.is_ready(self._rcl.is_action_server_available)

    def send_goal_request(self, request: Any) -> int:
        """Send a goal; return the number of the request."""
        server = self._server.for_request()
        if server is None:
            return int(self._rcl.send_goal_request(request))
        number = self._server.next_number()
        goal_id = request.goal_id

        def on_feedback(feedback: Any) -> None:
            message = self._types.FeedbackMessage(goal_id=goal_id, feedback=feedback)
            self._receive({"feedback": message})

        def on_sent(sent: Future[LocalGoal]) -> None:
            response = self._types.SendGoalService.Response(accepted=sent.result().accepted)
            self._receive({"goal": (number, response)})

        server.send_goal(request.goal, on_feedback, goal_id).add_done_callback(on_sent)
        return number

    def send_cancel_request(self, request: Any) -> int:
        """Request the cancellation of a goal; return the number of the request."""
        server = self._server.for_request()
        if server is None:
            return int(self._rcl.send_cancel_request(request))
        return self._pass_on("cancel", server.cancel(LocalGoal(request.goal_info.goal_id, server)))

    def send_result_request(self, request: Any) -> int:
        """Request the result of a goal; return the number of the request."""
        server = self._server.for_request()
        if server is None:
            return int(self._rcl.send_result_request(request))
        return self._pass_on("result", server.result(LocalGoal(request.goal_id, server)))

    def _pass_on(self, kind: str, future: Future[Any]) -> int:
        number = self._server.next_number()
        future.add_done_callback(lambda done: self._receive({kind: (number, done.result())}))
        return number
