"""A node outside the process, as the supervision sees it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Set

from rclpy.node import Node as RosNode

from composer.base.characters import shortened
from composer.base.fast_dataclass import dataclass
from composer.model import External, LogLevel, Node, Outside
from composer.model.lifecycle import (
    ACTIVE,
    FINALIZED,
    INACTIVE,
    TRANSITIONS,
    UNCONFIGURED,
    last_transition,
)
from composer.model.names import split_node_name
from composer.runtime.callbacks.log import logger_name
from composer.runtime.children.child_processes import ChildProcesses
from composer.runtime.executors.futures import Cancelled
from composer.runtime.executors.tasks import sleep
from composer.runtime.executors.tracebacks import describe
from composer.runtime.node.managed_node import (
    ManagedContext,
    ManagedLifecycle,
    ManagedNode,
    TransitionLock,
    TransitionOutcome,
)
from composer.runtime.outside_nodes.remote_node import (
    DONE_IN,
    NodePresence,
    NotAnswered,
    RemoteLifecycle,
)

#: The transitions by the states in which they run.
_BY_DURING = {item.during: name for name, item in TRANSITIONS.items()}
_AFTER_ERROR = "errorprocessing"
_POLL_S = 0.02
_MAX_MISSING = 3
#: How often an external node is looked for.
PERIOD_S = 0.5


class TransitionRefused(Exception):
    """A transition has failed. ``state`` is the state of the node now."""

    def __init__(self, reason: str, state: str) -> None:
        super().__init__(reason)
        self.state = state


@dataclass(frozen=True, slots=True)
class OutsideContext(ManagedContext):
    """What a node outside the process uses in this process.

    ``manager`` is the ROS node that observes and calls it. ``nodes`` are the nodes of the process,
    by their keys.
    """

    manager: RosNode
    children: ChildProcesses
    log_level: LogLevel
    nodes: Mapping[str, ManagedNode]


class OutsideNode(ManagedNode, ManagedLifecycle):
    """A :class:`.ManagedNode` of another process, and its :class:`.ManagedLifecycle`.

    A subclass does the work of transitions, on the loop.
    """

    def __init__(self, model: Node, context: OutsideContext) -> None:
        ManagedNode.__init__(self, model, context)
        ManagedLifecycle.__init__(self)
        self.lifecycle = self
        self._logger = logger_name(model.full_name)
        self._state = UNCONFIGURED
        #: Whether it is not there, and its return will be reported.
        self._is_lost = False
        #: Called if it ends by itself, before that is reported.
        self.followers: set[Callable[[], None]] = set()

    # --- the managed node

    @property
    def state(self) -> str:
        """The label of the lifecycle state."""
        return self._state

    @property
    def is_absent(self) -> bool:
        """Whether it is not there, and something else has to start it."""
        return self._is_lost

    # --- the lifecycle

    async def _run(self, transition: str, *, requested: bool) -> TransitionOutcome:
        """Run a transition; the lock has been acquired, and is released at the end."""
        try:
            result = await self._transition(transition, requested=requested)
        finally:
            self._lock.release()
        self._on_settled()
        return result

    async def _transition(self, transition: str, *, requested: bool) -> TransitionOutcome:
        start = self._state
        if transition not in self.available:
            names = ", ".join(self.available) or "none"
            reason = f"refused: the node is {start}; available transitions: {names}"
            return TransitionOutcome(transition, start, success=False, reason=reason)
        self.transition_started_s = self.loop.clock.monotonic()
        self._state = TRANSITIONS[transition].during
        state, reason = start, "its executor has stopped"
        try:
            await self._work(transition)
            state, reason = TRANSITIONS[transition].goal, ""
        except TransitionRefused as refusal:
            state, reason = refusal.state, str(refusal)
        except Cancelled:
            raise
        except Exception as error:
            reason = describe(error)
        finally:
            self._state = state
        self.activations += state == ACTIVE
        result = TransitionOutcome(
            transition, state, success=not reason, reason=reason, requested=requested
        )
        self._listener.on_transition_end(result)
        return result

    @abstractmethod
    async def _work(self, transition: str) -> None:
        """Do the work of a transition. Raises TransitionRefused."""

    def _on_settled(self) -> None:
        """React to what happened during a transition."""

    def _fail(self, reason: str, *, is_awaited: bool = False) -> None:
        """Report that the node has ended by itself, and is unconfigured now."""
        self._state = UNCONFIGURED
        for follow in tuple(self.followers):
            follow()
        self._listener.on_ended(reason, is_awaited=is_awaited)

    def _on_state(self, start: str, state: str) -> None:
        """Follow a transition event and the state after it."""
        if self._lock.is_held or self._state in (state, FINALIZED):
            return
        transition = _BY_DURING.get(start) or last_transition(self._state, state)
        success = start != _AFTER_ERROR and state in DONE_IN[transition]
        reason = "" if success else "a transition that another tool requested has failed"
        self._follow(transition, state, reason)

    def _follow(self, transition: str, state: str, reason: str = "") -> None:
        """Report a transition that another tool has requested from the node itself."""
        self._state = state
        self.activations += state == ACTIVE
        self._listener.on_transition_end(
            TransitionOutcome(transition, state, success=not reason, reason=reason)
        )

    async def _until_ready(self, condition: Callable[[], bool], end_s: float) -> bool:
        """Wait for ``condition()`` until ``end_s``, or until the system shuts down."""
        await self._until(lambda: condition() or self._run_state.end_s is not None, end_s)
        return condition()

    async def _until(self, condition: Callable[[], bool], end_s: float) -> bool:
        """Wait for ``condition()`` until ``end_s`` (monotonic); return its value."""
        while not condition():
            if self.loop.clock.monotonic() >= end_s:
                return False
            await sleep(self.loop, _POLL_S)
        return True


class ObservedNode(OutsideNode):
    """A node of another program, which is looked for in the ROS graph.

    With ``lifecycle: managed``, its lifecycle services drive it.
    """

    def __init__(self, model: Node, outside: Outside, context: OutsideContext) -> None:
        super().__init__(model, context)
        self._outside = outside
        self._manager = context.manager
        self.presence = NodePresence(self._manager, model)
        #: Held while a container loads or unloads: of requests that wait, DDS keeps ten.
        self.loading = TransitionLock()
        self._remote: RemoteLifecycle | None = None

    def _is_there(self) -> bool:
        """Return whether it can be used: with its service if it is managed, or all its ports."""
        if self._outside.is_managed:
            return bool(self.presence.servers(self._service))
        return self.presence.has_node() and not self.presence.missing()

    def _missing(self) -> str:
        """Return what it does not have yet, in words; without ports, the node is missing."""
        if self._outside.is_managed:
            return f"it has no service {self._service}"
        names = [f"{port.kind} {port.full_name}" for port in self.presence.missing()]
        if not names:
            return "it is not in the ROS graph"
        return f"it has no {shortened(names, _MAX_MISSING)}"

    @property
    def _service(self) -> str:
        return f"{self.full_name}/change_state"

    def _connect_remote(self) -> None:
        self._close_remote()
        self._remote = RemoteLifecycle(self._manager, self.loop, self.full_name, self._on_state)

    def _close_remote(self) -> None:
        if self._remote is not None:
            self._remote.close()
            self._remote = None


def elsewhere_text(model: Node, names: Set[str]) -> str:
    """Return which other nodes there are instead of an awaited one, and what to write for them."""
    if not names or model.full_name in names:
        return ""
    shown = sorted(names)[:_MAX_MISSING]
    if len(names) > 1:
        return f"; there are {', '.join(shown)} instead: list them under 'nodes' of the executable"
    namespace, name = split_node_name(shown[0])
    keys = [f"'name: {name}'"] if name != model.ros_name.value else []
    keys += [f"'namespace: {namespace}'"] if namespace != model.namespace.value else []
    return f"; there is {shown[0]} instead: write {' and '.join(keys)}"


class ExternalNode(ObservedNode):
    """The :class:`.ManagedNode` of an external node.

    It is active once its ports are in the ROS graph. It is driven by its lifecycle services only if
    it is declared as managed, and never shut down.
    """

    def __init__(self, model: Node, external: External, context: OutsideContext) -> None:
        super().__init__(model, external, context)
        self._timer = self.loop.call_every(PERIOD_S, self._check)

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take, including the time until the node appears."""
        return self._timeout_s + self._outside.ready_timeout_s

    def destroy(self) -> None:
        """Stop to observe the node."""
        self._timer.cancel()
        self._close_remote()

    async def _work(self, transition: str) -> None:
        if self._run_state.leaves_others:
            return
        if self._outside.is_managed and transition != "shutdown":
            await self._work_managed(transition)
        elif transition == "activate":
            await self._await(INACTIVE)
        if transition in ("cleanup", "shutdown"):
            self._close_remote()

    async def _await(self, state: str) -> None:
        """Wait until it can be used. Otherwise, raise TransitionRefused with ``state``."""
        limit_s = self._outside.ready_timeout_s
        if not await self._until_ready(self._is_there, self.loop.clock.monotonic() + limit_s):
            self._is_lost = True
            elsewhere = elsewhere_text(self.model, self.presence.names_elsewhere())
            advice = elsewhere or "; start it, or see 'ros2 node list'"
            raise TransitionRefused(f"{self._missing()} after {limit_s:g} s{advice}", state)
        self._is_lost = False

    async def _work_managed(self, transition: str) -> None:
        if transition == "configure":
            await self._await(UNCONFIGURED)
            self._connect_remote()
        if self._remote is None:
            raise TransitionRefused("it is not connected", UNCONFIGURED)
        end_s = self.loop.clock.monotonic() + self._timeout_s
        try:
            state = await self._remote.state(end_s)
            if (
                state in TRANSITIONS[transition].ids
            ):  # otherwise, something else has moved it already
                success, state = await self._remote.change(transition, end_s)
                if not success:
                    raise TransitionRefused(f"its service reports a failure; it is {state}", state)
        except NotAnswered as error:
            text = f"{error} within {self._timeout_s:g} s"
            raise TransitionRefused(text, UNCONFIGURED) from error

    def _check(self) -> None:
        """Notice that the node disappears, and that it returns."""
        if self._lock.is_held or self.state not in (UNCONFIGURED, INACTIVE, ACTIVE):
            return
        is_used = self.state == ACTIVE or self._remote is not None
        if is_used and not self.presence.has_node():
            self._is_lost = True
            self._close_remote()
            self._fail("it has disappeared from the ROS graph", is_awaited=True)
        elif self._is_lost and self._is_there():
            self._is_lost = False
            self._listener.on_returned()
