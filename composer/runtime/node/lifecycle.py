"""The lifecycle of one node: its state machine, services and transitions.

rcl's state machine holds the state, so every ROS 2 tool sees it. rclpy's layer above it is not
used: there, one request with a wrong id ends the process, exceptions disappear, and a callback
that returns None leaves the node in a transition state forever.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from lifecycle_msgs.msg import State, Transition, TransitionDescription
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.type_support import check_is_valid_srv_type

from composer.behavior import TransitionFailed
from composer.model.lifecycle import TRANSITIONS
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.sources import Reply, unused_callback
from composer.runtime.executors.tasks import within
from composer.runtime.executors.tracebacks import (
    describe,
    internal_report_of,
    is_closing,
    report_of,
    text_of,
)
from composer.runtime.intra_process.taps import transition_tap
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.node.managed_node import ManagedLifecycle, TransitionOutcome
from composer.runtime.ros.service_requests import TooLarge, limited

if TYPE_CHECKING:
    from composer.runtime.node.local_node import LocalNode

_Work: TypeAlias = Callable[[], Coroutine[Any, Any, None]]
_LABEL_LENGTH = 80
_SUCCESS, _FAILURE, _ERROR = "transition_success", "transition_failure", "transition_error"


class TransitionTimeout(Exception):
    """An asynchronous handler of a transition did not finish in time."""


class Lifecycle(ManagedLifecycle):
    """The state machine of one node, its services and its ``transition_event`` topic.

    It runs one transition at a time. During a transition, ``change_state`` requests fail, while
    :meth:`change` and :meth:`run_step` wait.
    """

    def __init__(
        self, context: NodeContext, owner: LocalNode, *, timeout_s: float, services: bool = True
    ) -> None:
        """Join the graph. Without ``services`` there is only the topic ``transition_event``.

        ``owner`` does the work of transitions: TransitionFailed refuses one, any other exception
        starts error processing.
        """
        super().__init__()
        node = context.node
        loop = context.loop
        self._node = node
        self._loop = loop
        self._strand = context.strand
        self._owner = owner
        self._log = context.log
        self._statistics = context.statistics
        self._timeout_s = timeout_s
        self._last_state = ""
        self._repeats = RepeatLimit(loop.clock)
        self._pending_reply: list[Reply] = []  # of the change_state request for it, if any
        self._tap = transition_tap(
            context.router.recorder, node.get_fully_qualified_name(), loop.clock
        )
        with node.handle:
            self._machine = rclpy_implementation.LifecycleStateMachine(node.handle, services)
        self._services: list[Service] = []
        if services:
            self._add_services(context)

    def _add_services(self, context: NodeContext) -> None:
        self._services = _services(self._node, self._machine)
        callbacks: tuple[Callable[[Any, Reply], None], ...] = (
            self._on_change_state,
            self._on_get_state,
            self._on_get_available_states,
            partial(self._on_get_transitions, "available_transitions"),
            partial(self._on_get_transitions, "transition_graph"),
        )
        for service, callback in zip(self._services, callbacks, strict=True):
            context.serve(service, callback)

    @property
    def state(self) -> str:
        """The label of the state: a primary state, or a transition state such as *activating*.

        Thread-safe. Once the machine is destroyed, this is its last state.
        """
        try:
            with self._machine:
                return str(self._machine.current_state[1])
        except InvalidHandle:
            return self._last_state

    def fail_request(self) -> None:
        """Answer the pending ``change_state`` request: its transition hangs. Thread-safe."""
        self._answer(success=False)

    def destroy(self) -> None:
        """Destroy the services and the state machine, which holds the node."""
        for service in self._services:
            self._loop.remove(service)
            self._node.destroy_service(service)
        self._last_state = self.state
        self._machine.destroy_when_not_in_use()

    async def _run(self, transition: str, *, requested: bool) -> TransitionOutcome:
        """Run a transition; the state machine has been acquired, and is released at the end."""
        try:
            return await self._transition(transition, requested=requested)
        except Cancelled:
            raise
        except BaseException as error:
            if is_closing(error):
                raise
            # Exceptions of user code do not get here: rcl failed, maybe without its context.
            self._log.error(f"'{transition}' was not completed: {internal_report_of(error)}")
            return TransitionOutcome(transition, self.state, success=False, reason=describe(error))
        finally:
            self._lock.release()

    async def _transition(self, transition: str, *, requested: bool) -> TransitionOutcome:
        start = self.state
        transition_id = self.available.get(transition)
        if transition_id is None:
            return self._refuse(transition, f"the node is {start}")
        self._trigger(transition_id)
        cause = await self._attempt(
            transition, partial(self._owner.on_transition, transition, start)
        )
        reason = ""
        if cause is None:
            self._trigger(_SUCCESS)
        elif issubclass(type(cause), TransitionFailed):
            reason = text_of(cause)
            self._trigger(_FAILURE)
        else:
            reason = describe(cause)
            self._trigger(_ERROR)
            await self._process_error(cause)
        result = TransitionOutcome(
            transition, self.state, success=cause is None, reason=reason, requested=requested
        )
        self._owner.on_transition_end(result)
        return result

    def _trigger(self, transition: int | str) -> None:
        """Make a step of rcl's machine, by its id or its label: to the next state, or the end."""
        if self._tap is not None:
            entries = map(_described, self._machine.available_transitions)
            step = next(
                item
                for item in entries
                if transition in (item.transition.id, item.transition.label)
            )
            self._tap(step)
        if isinstance(transition, int):
            self._machine.trigger_transition_by_id(transition, True)
        else:
            self._machine.trigger_transition_by_label(transition, True)

    async def _attempt(self, transition: str, work: _Work) -> BaseException | None:
        """Do the work of a transition; return the exception that it raised."""
        try:
            await self._in_time(work)
        except TransitionFailed as failure:
            text = f"on_{transition} refused the transition: {text_of(failure)}"
            self._warn(text, text)
            return failure
        except BaseException as error:
            if is_closing(error):
                raise
            self._log_error(f"on_{transition}", error)
            return error
        return None

    def _log_error(self, handler: str, error: BaseException) -> None:
        self._statistics.errors += 1
        self._log.error(f"{handler}: {report_of(error)}")

    async def _process_error(self, cause: BaseException) -> None:
        try:
            await self._in_time(partial(self._owner.on_error, cause))
        except BaseException as error:
            if is_closing(error):
                raise
            self._log_error("on_error", error)
            self._trigger(_FAILURE)
        else:
            self._trigger(_SUCCESS)

    async def _in_time(self, work: _Work) -> None:
        """Do the work. Its time starts when the loop starts it: other nodes may keep the loop."""
        started: Future[None] = Future()

        async def start() -> None:
            started.set_result(None)
            await self._strand.wrap(work())

        try:
            await within(self._loop, self._run_task(start()), self._timeout_s, after=started)
        except TimeoutError as error:
            raise TransitionTimeout(f"timed out after {self._timeout_s:g} s") from error
        except Cancelled as error:
            raise TransitionTimeout("the executor is stopping") from error

    def _run_task(self, work: Coroutine[Any, Any, None]) -> Future[None]:
        """Run ``work`` on the loop, also when a late interrupt of a callback is raised here."""
        task: Future[None] | None = None
        try:
            task = self._loop.run_task(work)
            return task
        finally:
            if task is None:
                work.close()

    def _refuse(self, transition: str, why: str) -> TransitionOutcome:
        available = ", ".join(self.available) or "none"
        name = transition[:_LABEL_LENGTH]  # the label of a request may be any text
        name = name if name.isprintable() else ascii(name)[1:-1]
        reason = f"refused '{name}': {why}; available transitions: {available}"
        self._warn(transition if transition in TRANSITIONS else "", reason)
        return TransitionOutcome(transition, self.state, success=False, reason=reason)

    def _warn(self, subject: str, text: str) -> None:
        """Log a warning, at most once a second: another node may repeat its request."""
        self._repeats.warn(self._log.warn, subject, text)

    # --- the services

    def _on_change_state(self, request: ChangeState.Request | TooLarge, reply: Reply) -> None:
        if isinstance(request, TooLarge):
            self._warn("size", f"refused a request of 'change_state': {request.reason}")
            reply(ChangeState.Response(success=False))
            return
        if self._lock.try_acquire() is not None:
            self._refuse(_label(request), f"the node is {self.state}")
            reply(ChangeState.Response(success=False))
            return
        self._loop.run_task(self._answer_change_state(_requested(request, self.available), reply))

    async def _answer_change_state(self, transition: str, reply: Reply) -> None:
        self._pending_reply.append(reply)
        result = await self._run(transition, requested=True)
        self._answer(success=result.success)

    def _answer(self, *, success: bool) -> None:
        """Answer the pending request once: ``pop`` is atomic."""
        with suppress(IndexError):
            self._pending_reply.pop()(ChangeState.Response(success=success))

    def _on_get_state(self, _: GetState.Request, reply: Reply) -> None:
        state_id, label = self._machine.current_state
        reply(GetState.Response(current_state=State(id=state_id, label=label)))

    def _on_get_available_states(self, _: GetAvailableStates.Request, reply: Reply) -> None:
        states = [
            State(id=state_id, label=label) for state_id, label in self._machine.available_states
        ]
        reply(GetAvailableStates.Response(available_states=states))

    def _on_get_transitions(
        self, which: str, _: GetAvailableTransitions.Request, reply: Reply
    ) -> None:
        transitions = [_described(entry) for entry in getattr(self._machine, which)]
        reply(GetAvailableTransitions.Response(available_transitions=transitions))


def _requested(request: ChangeState.Request, available: Mapping[str, int]) -> str:
    """Return the name of the requested transition: its label if there is one, else by its id.

    The id of a shutdown must match the state: there is one for each state it can start from.
    """
    if request.transition.label:
        return str(request.transition.label)
    names = {number: name for name, number in available.items()}
    return names.get(request.transition.id) or _label(request)


def _label(request: ChangeState.Request) -> str:
    return str(request.transition.label) or f"transition {request.transition.id}"


def _described(entry: tuple[int, str, int, str, int, str]) -> TransitionDescription:
    transition_id, label, start_id, start, goal_id, goal = entry
    return TransitionDescription(
        transition=Transition(id=transition_id, label=label),
        start_state=State(id=start_id, label=start),
        goal_state=State(id=goal_id, label=goal),
    )


def _services(node: Node, machine: Any) -> list[Service]:
    """Wrap the services that rcl created, so that the node owns and destroys them."""
    group = node.default_callback_group
    services = [
        Service(handle, kind, handle.name, unused_callback, group, QoSProfile(**handle.qos))
        for handle, kind in (
            (machine.service_change_state, limited(ChangeState)),
            (machine.service_get_state, GetState),
            (machine.service_get_available_states, GetAvailableStates),
            (machine.service_get_available_transitions, GetAvailableTransitions),
            (machine.service_get_transition_graph, GetAvailableTransitions),
        )
    ]
    for service in services:
        check_is_valid_srv_type(service.srv_type)  # also loads the type support
        group.add_entity(service)
    node._services.extend(services)
    return services
