"""What the coordinating process of a system requests of another one: to move its nodes.

Also requests of clients to the lifecycle and parameter services that nodes leave to the manager:
with ``introspection``, the nodes of a large system create none of these services. A client
sends what it would send to them to the service ``request`` of the manager, which has it answered on
the loop of the node.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Generic, TypeVar

from lifecycle_msgs.msg import State, Transition, TransitionDescription
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState

from composer.base.fast_dataclass import dataclass
from composer.model.lifecycle import FINALIZED, TRANSITIONS
from composer.runtime.executors.futures import Cancelled, Future
from composer.runtime.executors.loop import Loop
from composer.runtime.manager.publishing import ManagerContext, ReportPublisher
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.node.local_node import LocalNode
from composer.runtime.node.managed_node import (
    ManagedNode,
    TransitionOutcome,
)
from composer.runtime.node.parameter_services import PARAMETER_SERVICES
from composer.runtime.outside_nodes.remote_node import DONE_IN
from composer.runtime.protocol.requests import (
    CREATE,
    AskReportKey,
    CallNodes,
    ChangeStates,
    NodeCall,
    NodeResponses,
    ReportKey,
    Step,
    StepResult,
    StepResults,
)
from composer.runtime.ros.messages import MessageError, convert_message, to_plain

#: Returns the nodes of the system by their full names.
Nodes = Callable[[], Mapping[str, ManagedNode]]

_LIFECYCLE_SERVICES: Mapping[str, Any] = {
    "get_state": GetState,
    "get_available_transitions": GetAvailableTransitions,
    "change_state": ChangeState,
}
_MAX_LISTED = 3
_TRANSITIONS = (*DONE_IN, CREATE)
_CONFIGURE, _SHUTDOWN = "configure", "shutdown"
T = TypeVar("T")


async def answer_calls(request: CallNodes, nodes: Mapping[str, ManagedNode]) -> NodeResponses:
    """Return the responses of the services of ``nodes``, which are by their full names."""
    return NodeResponses(tuple([await _response(call, nodes) for call in request.calls]))


async def _response(call: NodeCall, nodes: Mapping[str, ManagedNode]) -> Mapping[str, Any] | None:
    name, _, service = call.service.rpartition("/")
    node = nodes.get(name)
    kind = _LIFECYCLE_SERVICES.get(service) or PARAMETER_SERVICES.get(service)
    if node is None or kind is None:
        return None
    try:
        request = convert_message(call.request, kind.Request, f"the request to '{call.service}'")
    except MessageError:
        return None
    if service in _LIFECYCLE_SERVICES:
        response = await _lifecycle_response(node, request)
    elif isinstance(node, LocalNode):
        services = node.parameter_services
        response = await node.loop.run_task(services.answer(service, request, kind.Response()))
    else:
        return None
    plain: Mapping[str, Any] = to_plain(response)
    return plain


async def _lifecycle_response(node: ManagedNode, request: Any) -> Any:
    if isinstance(request, GetState.Request):
        return GetState.Response(current_state=State(label=node.state))
    if isinstance(request, ChangeState.Request):
        change = node.lifecycle.change(request.transition.label)
        return ChangeState.Response(success=(await node.loop.run_task(change)).success)
    transitions = [
        TransitionDescription(
            transition=Transition(id=number, label=label),
            start_state=State(label=node.state),
            goal_state=State(label=TRANSITIONS[label].during),
        )
        for label, number in node.lifecycle.available.items()
    ]
    return GetAvailableTransitions.Response(available_transitions=transitions)


@dataclass(slots=True)
class _RunningStep:
    """A step that runs, or has ended with ``result``."""

    change: Future[TransitionOutcome]
    result: StepResult | None = None


class MemberService:
    """Answers the requests of the coordinating process."""

    def __init__(
        self,
        loop: Loop,
        context: ManagerContext,
        reports: ReportPublisher,
        log: Callable[[str], None],
    ) -> None:
        self._loop = loop
        self._context = context
        self._reports = reports
        self._log = log
        self._received = ReceivedSteps[_RunningStep]()
        self._repeats = RepeatLimit(loop.clock)

    def on_request(
        self, request: ChangeStates | AskReportKey, reply: Callable[[Any], None]
    ) -> None:
        """Answer a request, now or later."""
        if isinstance(request, AskReportKey):
            if not self._context.status.without_nodes.is_child:  # else, it has given the key
                reply(ReportKey(self._context.report_key))
            return
        if request.participant and request.participant != self._reports.participant:
            return  # for another process of the same name
        if self._reports.is_outdated(request.seen_report):
            self._log_late(request.steps)
        else:
            if request.are_last:
                self._reports.includes_timings = True
                self._context.expect_end()
            self._loop.run_task(self._change_states(request, reply))

    def _log_late(self, steps: Sequence[Step]) -> None:
        admission = self._repeats.admit("late")
        if admission is None:
            return
        nodes = self._context.nodes()
        known = [step for step in steps if step.transition in _TRANSITIONS and step.node in nodes]
        listed = ", ".join(map(str, known[:_MAX_LISTED]))
        self._log(f"ignored a request that has arrived too late: {listed}{admission.suffix}")

    async def _change_states(self, request: ChangeStates, reply: Callable[[Any], None]) -> None:
        """Run all steps of a request, at the same time unless they wait for each other."""
        nodes = self._context.nodes()
        running = [self._start(request.sender, step, nodes) for step in request.steps]
        results: list[StepResult] = []
        try:
            for step in running:
                results.append(await self._result(step))  # noqa: PERF401 - kept if canceled
        finally:
            reply(StepResults(tuple(results)))
        if any(step.transition == _SHUTDOWN for step in request.steps):
            self._reports.publish()  # the coordinating process waits for their last counters

    def _start(
        self, sender: str, step: Step, nodes: Mapping[str, ManagedNode]
    ) -> _RunningStep | str:
        """Start a step unless it was received before; return it, or why it is not started."""
        node = nodes.get(step.node)
        if node is None:
            return "the process has no such node"
        known = self._received.find(sender, step)
        if known is not None:
            return known
        if self._received.is_replaced(sender, step):
            return "a later request was received before"
        before = self._received.of(step.after)
        earlier = [other.change for other in before if not other.change.done()]
        if earlier:
            change = self._loop.run_task(self._change_after(earlier, node, step.transition))
        else:
            change = node.loop.run_task(self._change(node, step.transition))
        new = _RunningStep(change)
        self._received.add(sender, step, new)
        return new

    async def _change_after(
        self, earlier: Sequence[Future[TransitionOutcome]], node: ManagedNode, transition: str
    ) -> TransitionOutcome:
        """Run a transition once others have ended, whether they have succeeded or not."""
        for other in earlier:
            with suppress(Cancelled, Exception):
                await other
        return await node.loop.run_task(self._change(node, transition))

    async def _change(self, node: ManagedNode, transition: str) -> TransitionOutcome:
        """Run a transition, on the loop of the node; a finalized node is created again for it.

        The coordinating process configures one only to restart it, or to bring the system up.
        """
        if transition in (_CONFIGURE, CREATE) and node.state == FINALIZED:
            problem = self._context.recreate(node)
            if problem is not None:
                return TransitionOutcome(transition, FINALIZED, success=False, reason=problem)
            node = self._context.nodes()[node.full_name]
        if node.state in DONE_IN.get(transition, ()):  # by a request that was given up, perhaps
            return TransitionOutcome(transition, node.state, success=True)
        if transition == CREATE:
            return TransitionOutcome(transition, node.state, success=True)
        return await node.lifecycle.change(transition)

    async def _result(self, step: _RunningStep | str) -> StepResult:
        """Return the result of a step, which is the same if it is requested again."""
        if isinstance(step, str):
            return StepResult(success=False, reason=step)
        outcome = await step.change
        if step.result is None:
            reason = "" if outcome.success else outcome.reason
            step.result = StepResult(outcome.success, reason, self._reports.number)
        return step.result


class ReceivedSteps(Generic[T]):
    """The last step of each node, with its sender and what runs it: no step is run twice.

    A request that may be lost is sent again, so that its steps may arrive twice.
    """

    def __init__(self) -> None:
        self._last: dict[str, tuple[str, int, T]] = {}

    def find(self, sender: str, step: Step) -> T | None:
        """Return what runs a step that was received before; None if it is a new one."""
        last = self._last.get(step.node)
        return last[2] if last is not None and last[:2] == (sender, step.number) else None

    def is_replaced(self, sender: str, step: Step) -> bool:
        """Return whether a later step of the node was received before, from the same sender."""
        last_sender, last_number, _ = self._last.get(step.node, ("", 0, None))
        return sender == last_sender and step.number < last_number

    def add(self, sender: str, step: Step, running: T) -> None:
        """Keep what runs a new step."""
        self._last[step.node] = sender, step.number, running

    def of(self, nodes: Iterable[str]) -> list[T]:
        """Return what runs, or ran, the last steps of some nodes."""
        return [self._last[node][2] for node in nodes if node in self._last]
