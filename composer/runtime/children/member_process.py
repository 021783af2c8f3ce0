"""A process of the system that runs some of its nodes: started, observed, and asked to move them.

It is ``compose run SYSTEM --process NAME``, with a manager node of its own. The states of its nodes
are in its reports; requests for transitions go to the manager's service. If it runs already, or
belongs to another computer, it is awaited instead of started.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from time import monotonic
from typing import Any, Protocol

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node as RosNode

from composer.model import LogLevel, Process
from composer.runtime.children.child_processes import Child, ChildProcesses, Command, StartFailed
from composer.runtime.children.output import parse_line
from composer.runtime.executors.exceptions import printable
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import sleep
from composer.runtime.metrics.numbers import finite
from composer.runtime.node.outcome import FINALIZED
from composer.runtime.process.environment import CONSOLE_FORMAT
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.ros.manager_protocol import CHANGE_STATE, NAME, STATE_QOS, STATE_TOPIC

_POLL_S = 0.01
#: How long a process may take to import ROS, join the graph and report, on a busy machine.
_STARTS_WITHIN_S = 30.0
_CHECK_PERIOD_S = 0.5
#: Managers report every second.
_REPORTS_WITHIN_S = 5.0
_ENDS_WITHIN_S = 1.0
_KILLED_WITHIN_S = 0.5
#: The logger of ``compose run``. What it says of states, the process that coordinates says as well.
_COMPOSE = "compose"


class ProcessUnavailable(Exception):
    """The process cannot be started, or has ended; the text is the reason."""


@dataclass(frozen=True, slots=True)
class MemberState:
    """A node as its process reports it: its state, and why it is held down, if it has failed.

    ``figures`` are rates and counters, by the names of the fields of ``NodeStatus``.
    """

    state: str
    held_down: str
    figures: Mapping[str, Any] = field(default_factory=dict)


class Member(Protocol):
    """A node of the process. Called on the loop."""

    @property
    def full_name(self) -> str:
        """Its name in reports."""

    def on_report(self, reported: MemberState) -> None:
        """Receive its state, with each report."""

    def on_process_end(self, reason: str) -> None:
        """Receive that the process has ended or does not report any more."""

    def on_process_return(self) -> None:
        """Receive that a process that something else has started is there again."""


@dataclass(frozen=True, slots=True)
class MemberContext:
    """What a process of the system needs from the one that coordinates it.

    ``namespace`` is that of the coordinating manager; ``command`` starts ``compose run`` with the
    same system; ``is_local`` is whether the process belongs to this computer.
    """

    loop: Loop
    manager: RosNode
    children: ChildProcesses
    namespace: str
    command: Sequence[str]
    is_local: bool
    write_log: Callable[[LogLevel, str, str], None]


@dataclass(slots=True)
class _Life:
    """One life of the process: its child, if it was started here, and what it reported."""

    child: Child | None = None
    states: dict[str, MemberState] = field(default_factory=dict)
    reported_s: float = 0.0


class MemberProcess:
    """One process of the system."""

    def __init__(self, process: Process, context: MemberContext) -> None:
        self._process = process
        self._context = context
        self._name = f"{context.namespace}/{process.name.value}"
        self._members: dict[str, Member] = {}
        self._life: _Life | None = None  # from the start, or the first report, to the end
        self._starting: Future[None] | None = None
        self._is_ending = False
        manager = f"{self._name}/{NAME}"
        self._client = context.manager.create_client(ChangeState, f"{manager}/{CHANGE_STATE}")
        self._reports = context.manager.create_subscription(
            DiagnosticArray, f"{manager}/{STATE_TOPIC}", lambda _: None, STATE_QOS
        )
        context.loop.add_client(self._client)
        context.loop.add_subscription(self._reports, self._on_report)
        self._timer = context.loop.call_every(_CHECK_PERIOD_S, self._check)

    def add(self, member: Member) -> None:
        """Add a node, in place of an earlier one of the same name."""
        self._members[member.full_name] = member

    @property
    def pid(self) -> int | None:
        """Its process id, if it was started here."""
        return None if self._life is None or self._life.child is None else self._life.child.pid

    def state(self, node: str) -> MemberState | None:
        """Return the last reported state of a node; None if the process does not run."""
        return None if self._life is None else self._life.states.get(node)

    def start_soon(self) -> None:
        """Start the process unless it runs: all at once, not each with its first node."""

        async def start() -> None:
            with suppress(ProcessUnavailable):  # the first node that is configured reports it
                await self.ensure()

        self._context.loop.run_task(start())

    async def ensure(self) -> None:
        """Start the process unless it runs, and wait for its first report.

        Raises ProcessUnavailable.
        """
        while self._starting is not None:
            await self._starting
        if self._life is not None and self._life.states:
            return
        self._starting = Future()
        try:
            await self._start()
        finally:
            starting, self._starting = self._starting, None
            starting.set_result(None)

    async def change(self, node: str, transition: str, end_s: float) -> bool:
        """Request a transition of a node; return whether it succeeded.

        Raises ProcessUnavailable if the process ends, or does not respond until ``end_s``.
        """
        life = self._life
        if life is None:
            raise ProcessUnavailable(f"{self} does not run")
        while not self._client.service_is_ready():
            await self._pause(life, end_s)
        request = ChangeState.Request(transition=Transition(label=f"{node} {transition}"))
        future = self._client.call_async(request)
        try:
            while not future.done():
                await self._pause(life, end_s)
        finally:
            self._client.remove_pending_request(future)
        response: Any = future.result()
        return bool(response.success)

    async def kill(self, reason: str) -> None:
        """End a process in which a node hangs; a failure of all its nodes.

        Raises ProcessUnavailable if it was not started here.
        """
        life = self._life
        if life is None or life.child is None:
            raise ProcessUnavailable(f"{reason}, and {self} was not started here")
        self._context.children.end(life.child, 0.0, 0.0)
        while not life.child.ended.done():
            await sleep(self._context.loop, _POLL_S)
        self._on_end(life)

    def end(self) -> None:
        """End the process if it was started here, without waiting for that."""
        life = self._life
        if life is not None and life.child is not None and not self._is_ending:
            self._is_ending = True
            self._context.children.end(life.child, _ENDS_WITHIN_S, _KILLED_WITHIN_S)

    def end_if_done(self) -> None:
        """End the process if all its nodes are shut down."""
        states = {} if self._life is None else self._life.states
        if all(reported.state == FINALIZED for reported in states.values()):
            self.end()

    def close(self) -> None:
        """Stop to observe the process."""
        self._timer.cancel()
        for entity in (self._client, self._reports):
            self._context.loop.remove(entity)
        self._context.manager.destroy_client(self._client)
        self._context.manager.destroy_subscription(self._reports)

    def __str__(self) -> str:
        return f"process '{self._process.name}'"

    async def _start(self) -> None:
        """Start the process, or wait for one that is started elsewhere."""
        life = self._life or _Life()
        if self._context.is_local and self._name not in local_systems():
            life = await self._start_child()
        end_s = monotonic() + _STARTS_WITHIN_S
        while self._life is None or not self._life.states:
            if life.child is not None and life.child.ended.done():
                raise ProcessUnavailable(f"{self} {_how(life.child)}")
            if monotonic() > end_s:
                raise ProcessUnavailable(f"{self} has not reported within {_STARTS_WITHIN_S:g} s")
            await sleep(self._context.loop, _POLL_S)

    async def _start_child(self) -> _Life:
        environment = {name.value: value for name, value in self._process.environment}
        words = (*self._context.command, "--process", self._process.name.value)
        # Its lines are parsed, whatever format those of this process have.
        usual = {"PYTHONUNBUFFERED": "1", "RCUTILS_CONSOLE_OUTPUT_FORMAT": CONSOLE_FORMAT}
        command = Command(words, {**usual, **environment})
        self._is_ending = False
        try:
            child = self._context.children.start(command, self._log)
            await child.started
        except (OSError, StartFailed) as error:
            raise ProcessUnavailable(f"{self} cannot be started: {error}") from error
        self._life = life = _Life(child)
        child.ended.add_done_callback(
            lambda _: self._context.loop.call_soon(partial(self._on_end, life))
        )
        return life

    async def _pause(self, life: _Life, end_s: float) -> None:
        if self._life is not life:
            how = "" if life.child is None else _how(life.child)
            raise ProcessUnavailable(f"{self} {how or 'does not report any more'}")
        if monotonic() > end_s:
            raise ProcessUnavailable(f"{self} does not respond")
        await sleep(self._context.loop, _POLL_S)

    def _on_report(self, taken: tuple[Any, Any]) -> None:
        system, *nodes = taken[0].status or [None]
        if system is None or _values(system).get("activity") == "starting":
            return  # it has no nodes yet, and would refuse requests
        life = self._life
        if life is None:  # started elsewhere
            if self._is_ending:
                return
            life = self._life = _Life()
        was_silent = not life.states
        life.reported_s = monotonic()
        for status in nodes:
            name = status.name.partition(": ")[2]
            values = _values(status)
            life.states[name] = MemberState(
                values.get("state", ""), values.get("held_down", ""), _figures(values)
            )
        for name, reported in life.states.items():
            member = self._members.get(name)
            if member is not None:
                member.on_report(reported)
                if was_silent and life.child is None:
                    member.on_process_return()

    def _on_end(self, life: _Life) -> None:
        if self._life is not life:
            return
        self._life = None
        if life.child is not None and not self._is_ending:
            self._fail(f"{self} {_how(life.child)}")

    def _check(self) -> None:
        """Notice a process that does not report: it hangs, or is cut off."""
        life = self._life
        if life is None or not life.states or self._is_ending:
            return
        if monotonic() - life.reported_s < _REPORTS_WITHIN_S:
            return
        self._life = None
        if life.child is not None:
            self._context.children.end(life.child, 0.0, 0.0)
        self._fail(f"{self} has not reported for {_REPORTS_WITHIN_S:g} s")

    def _fail(self, reason: str) -> None:
        for member in tuple(self._members.values()):
            member.on_process_end(reason)

    def _log(self, text: str, is_error: bool) -> None:
        level, logger, message = parse_line(text, is_error=is_error)
        if logger == _COMPOSE and level is LogLevel.INFO:
            return
        self._context.write_log(level, logger or self._process.name.value, printable(message))


def _values(status: Any) -> dict[str, str]:
    return {item.key: item.value for item in status.values}


def _figures(values: Mapping[str, str]) -> Mapping[str, Any]:
    """Return the rates and counters in a report; none if it is not of this version."""
    try:
        numbers = {name: finite(values[name]) for name in ("sent_hz", "received_hz", "busy")}
        counts = {name: int(values[name]) for name in ("errors", "overruns", "queue_drops")}
    except (KeyError, ValueError):
        return {}
    return {**numbers, **counts, "slowest": values.get("slowest", "")}


def _how(child: Child) -> str:
    """Return how a process has ended, in words; empty while it runs."""
    if not child.ended.done() or child.ended.cancelled():
        return ""
    status = child.ended.result()
    return f"exited with status {status}" if status >= 0 else f"was ended by signal {-status}"
