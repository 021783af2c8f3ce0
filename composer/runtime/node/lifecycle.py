"""The lifecycle of one node, told truthfully.

rcl's own state machine holds the state, so every ROS 2 tool sees it. rclpy's handling of it is
not used: there, one request with a wrong id ends the process, exceptions vanish, and a callback
that returns nothing leaves the node between two states for ever.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeAlias

from lifecycle_msgs.msg import State, Transition, TransitionDescription
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.type_support import check_is_valid_srv_type

from composer.behavior import TransitionFailed
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.log import describe, traceback_of
from composer.runtime.executors.loop import Reply, never_called
from composer.runtime.executors.tasks import Cancelled, Future, within

_NAMES = {
    Transition.TRANSITION_CONFIGURE: "configure",
    Transition.TRANSITION_CLEANUP: "cleanup",
    Transition.TRANSITION_ACTIVATE: "activate",
    Transition.TRANSITION_DEACTIVATE: "deactivate",
    Transition.TRANSITION_UNCONFIGURED_SHUTDOWN: "shutdown",
    Transition.TRANSITION_INACTIVE_SHUTDOWN: "shutdown",
    Transition.TRANSITION_ACTIVE_SHUTDOWN: "shutdown",
}
_Work: TypeAlias = Callable[[], Coroutine[Any, Any, None]]
_SUCCESS, _FAILURE, _ERROR = "transition_success", "transition_failure", "transition_error"


class Hooks(Protocol):
    """What a node does in its transitions.

    Raising TransitionFailed refuses one; any other exception leads through error processing.
    """

    async def on_transition(self, transition: str, start: str) -> None:
        """Do the work of ``transition``, which began in the state ``start``."""

    async def on_error(self, cause: BaseException) -> None:
        """Clean up after a transition that raised ``cause``. Raising finalizes the node."""

    def on_rest(self, state: str, transition: str, cause: BaseException | None) -> None:
        """Take note that the node has come to rest in the primary state ``state``.

        ``cause`` is what went wrong on the way, if anything did.
        """


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a requested transition. ``reason`` says why it did not succeed."""

    success: bool
    state: str
    reason: str = ""


class TransitionTimeout(Exception):
    """A handler that awaits did not come to an end in time."""


class Lifecycle:
    """The state machine of one node, its services and its ``transition_event`` topic.

    One transition at a time: requests from outside are refused while one is under way, those of
    the host wait for their turn.
    """

    def __init__(
        self, core: NodeContext, hooks: Hooks, *, timeout_s: float, services: bool = True
    ) -> None:
        """Join the graph; without ``services`` with the topic ``transition_event`` alone."""
        node = core.node
        loop = core.loop
        self._node = node
        self._loop = loop
        self._strand = core.strand
        self._hooks = hooks
        self._log = core.log
        self._timeout_s = timeout_s
        self._lock = threading.Lock()
        self._under_way: Future[None] | None = None
        self._last_state = ""
        self._waiting: list[Reply] = []  # who asked for the transition under way, if from outside
        with node.handle:
            self._machine = rclpy_implementation.LifecycleStateMachine(node.handle, services)
        self._services: list[Service] = []
        if services:
            self._serve()

    def _serve(self) -> None:
        self._services = _services(self._node, self._machine)
        callbacks: tuple[Callable[[Any, Reply], None], ...] = (
            self._on_change_state,
            self._on_get_state,
            self._on_get_available_states,
            partial(self._on_get_transitions, "available_transitions"),
            partial(self._on_get_transitions, "transition_graph"),
        )
        for service, callback in zip(self._services, callbacks, strict=True):
            self._loop.add_service(service, callback)

    @property
    def state(self) -> str:
        """The label of the state: a primary one, or a transition state such as *activating*.

        From any thread, also while the machine is destroyed; after that it is the last one.
        """
        try:
            with self._machine:
                return str(self._machine.current_state[1])
        except InvalidHandle:
            return self._last_state

    @property
    def legal(self) -> Mapping[str, int]:
        """The transitions that may be requested now, with their ids."""
        try:
            with self._machine:
                available = self._machine.available_transitions
        except InvalidHandle:
            return {}
        return {
            _NAMES[transition_id]: transition_id
            for transition_id, *_ in available
            if transition_id in _NAMES
        }

    async def change(self, transition: str) -> Result:
        """Make the transition as soon as no other one is under way. Raises nothing."""
        while (under_way := self._begin()) is not None:
            await under_way
        return await self._change(transition)

    def give_up(self) -> None:
        """Answer who asked for the transition under way: it hangs. May be called on any thread."""
        self._answer(success=False)

    def destroy(self) -> None:
        """Give back the services and the state machine, which holds the node."""
        for service in self._services:
            self._loop.remove(service)
            self._node.destroy_service(service)
        self._last_state = self.state
        self._machine.destroy_when_not_in_use()

    def _begin(self) -> Future[None] | None:
        """Take the right to make a transition, or return the future of the one under way."""
        with self._lock:
            if self._under_way is None:
                self._under_way = Future()
                return None
            return self._under_way

    def _finish(self) -> None:
        with self._lock:
            under_way, self._under_way = self._under_way, None
        if under_way is not None:
            under_way.set_result(None)

    async def _change(self, transition: str) -> Result:
        """Make a transition; the right to has been taken and is given back."""
        try:
            return await self._transition(transition)
        except (Cancelled, GeneratorExit):
            raise
        except BaseException as error:
            # What user code raises is dealt with: this is rcl, whose context may have gone, or us.
            self._log.error(f"'{transition}' came to nothing: {traceback_of(error)}")
            return Result(success=False, state=self.state, reason=describe(error))
        finally:
            self._finish()

    async def _transition(self, transition: str) -> Result:
        start = self.state
        transition_id = self.legal.get(transition)
        if transition_id is None:
            return self._refused(transition, f"the node is {start}")
        self._machine.trigger_transition_by_id(transition_id, True)
        cause = await self._attempt(
            transition, partial(self._hooks.on_transition, transition, start)
        )
        if isinstance(cause, TransitionFailed):
            self._machine.trigger_transition_by_label(_FAILURE, True)
        elif cause is not None:
            self._machine.trigger_transition_by_label(_ERROR, True)
            await self._process_error(cause)
        else:
            self._machine.trigger_transition_by_label(_SUCCESS, True)
        state = self.state
        self._hooks.on_rest(state, transition, cause)
        if cause is None:
            return Result(success=True, state=state)
        return Result(success=False, state=state, reason=describe(cause))

    async def _attempt(self, transition: str, work: _Work) -> BaseException | None:
        """Do the work of a transition; return what went wrong."""
        try:
            await self._in_time(work)
        except TransitionFailed as failure:
            self._log.warn(f"on_{transition} refuses: {failure}")
            return failure
        except GeneratorExit:
            raise
        except BaseException as error:
            self._log.error(f"on_{transition}: {describe(error)}\n{traceback_of(error)}")
            return error
        return None

    async def _process_error(self, cause: BaseException) -> None:
        try:
            await self._in_time(partial(self._hooks.on_error, cause))
        except GeneratorExit:
            raise
        except BaseException as error:
            self._log.error(f"on_error: {describe(error)}\n{traceback_of(error)}")
            self._machine.trigger_transition_by_label(_FAILURE, True)
        else:
            self._machine.trigger_transition_by_label(_SUCCESS, True)

    async def _in_time(self, work: _Work) -> None:
        """Do the work. Its time begins with its turn on the loop, which others may keep it from."""
        turn: Future[None] = Future()

        async def in_turn() -> None:
            turn.set_result(None)
            await self._strand.wrap(work())

        try:
            await within(self._loop, self._begun(in_turn()), self._timeout_s, after=turn)
        except TimeoutError as error:
            raise TransitionTimeout(f"not through after {self._timeout_s:g} s") from error
        except Cancelled as error:
            raise TransitionTimeout("the executor is stopping") from error

    def _begun(self, work: Coroutine[Any, Any, None]) -> Future[None]:
        """Have the loop do it. What interrupts a callback may come late, and strike here."""
        task: Future[None] | None = None
        try:
            task = self._loop.run_task(work)
            return task
        finally:
            if task is None:
                work.close()

    def _refused(self, transition: str, why: str) -> Result:
        legal = ", ".join(self.legal) or "none"
        reason = f"'{transition}' is refused: {why}; legal now: {legal}"
        self._log.warn(reason)
        return Result(success=False, state=self.state, reason=reason)

    # --- the services

    def _on_change_state(self, request: ChangeState.Request, reply: Reply) -> None:
        if self._begin() is not None:
            self._refused(_shown(request), f"the node is {self.state}")
            reply(ChangeState.Response(success=False))
            return
        self._loop.run_task(self._answer_change_state(_requested(request, self.legal), reply))

    async def _answer_change_state(self, transition: str, reply: Reply) -> None:
        self._waiting.append(reply)
        result = await self._change(transition)
        self._answer(success=result.success)

    def _answer(self, *, success: bool) -> None:
        """Answer once: popping is atomic."""
        with suppress(IndexError):
            self._waiting.pop()(ChangeState.Response(success=success))

    def _on_get_state(self, _: GetState.Request, reply: Reply) -> None:
        state_id, label = self._machine.current_state
        reply(GetState.Response(current_state=State(id=state_id, label=label)))

    def _on_get_available_states(self, _: GetAvailableStates.Request, reply: Reply) -> None:
        states = [State(id=state_id, label=label) for state_id, label in _states(self._machine)]
        reply(GetAvailableStates.Response(available_states=states))

    def _on_get_transitions(
        self, which: str, _: GetAvailableTransitions.Request, reply: Reply
    ) -> None:
        transitions = [_described(entry) for entry in getattr(self._machine, which)]
        reply(GetAvailableTransitions.Response(available_transitions=transitions))


def _requested(request: ChangeState.Request, legal: Mapping[str, int]) -> str:
    """Return the transition that is asked for: by label where there is one, else by id.

    An id says more than a name for shutdown, which has one for each state it starts from.
    """
    if request.transition.label:
        return str(request.transition.label)
    name = _NAMES.get(request.transition.id)
    if name is not None and legal.get(name) == request.transition.id:
        return name
    return _shown(request)


def _shown(request: ChangeState.Request) -> str:
    return str(request.transition.label) or f"transition {request.transition.id}"


def _states(machine: Any) -> list[tuple[int, str]]:
    return list(machine.available_states)


def _described(entry: tuple[int, str, int, str, int, str]) -> TransitionDescription:
    transition_id, label, start_id, start, goal_id, goal = entry
    return TransitionDescription(
        transition=Transition(id=transition_id, label=label),
        start_state=State(id=start_id, label=start),
        goal_state=State(id=goal_id, label=goal),
    )


def _services(node: Node, machine: Any) -> list[Service]:
    """Wrap the services that rcl has made, so that the node owns and destroys them."""
    group = node.default_callback_group
    services = [
        Service(handle, kind, handle.name, never_called, group, QoSProfile(**handle.qos))
        for handle, kind in (
            (machine.service_change_state, ChangeState),
            (machine.service_get_state, GetState),
            (machine.service_get_available_states, GetAvailableStates),
            (machine.service_get_available_transitions, GetAvailableTransitions),
            (machine.service_get_transition_graph, GetAvailableTransitions),
        )
    ]
    for service in services:
        check_is_valid_srv_type(service.srv_type)  # it loads the type support as well
        group.add_entity(service)
    node._services.extend(services)
    return services
