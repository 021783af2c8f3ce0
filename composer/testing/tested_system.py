"""A system that runs under a test: its time, what it does, and waiting for it."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextlib import ExitStack
from math import inf
from pathlib import Path
from typing import Any, Self, TypeVar

from composer.bags.system_recording import SystemRecording
from composer.model import LogLevel, PortKind, System
from composer.model.system import Recording
from composer.runtime.clock import COMPUTER, START_NS, Clock, VirtualClock
from composer.runtime.executors.futures import Future
from composer.runtime.host_options import HostOptions
from composer.runtime.node.managed_node import ManagedNode
from composer.runtime.protocol.reports import ChainFigures
from composer.runtime.supervision.events import Event, Outcome
from composer.testing.declarations import load_file
from composer.testing.failures import LogLine, Received, TestFailure, unknown, unmet
from composer.testing.faults import Faults
from composer.testing.system_run import Answer, Observation, SystemRun
from composer.testing.tester import TESTER, Tester, port_to, with_tester

T = TypeVar("T")


class TestedSystem:
    """The base of :class:`.SystemTest`, which has what a test does to the system."""

    __test__ = False  # no class of tests

    def __init__(
        self,
        system: Path | str | System,
        *,
        arguments: Mapping[str, Any] | None = None,
        settings: Mapping[str, Any] | None = None,
        seed: int = 0,
        real_time: bool = False,
        start_ns: int = START_NS,
        record_to: Path | None = None,
        log_level: LogLevel = LogLevel.INFO,
    ) -> None:
        """Raise TestFailure if the file cannot be read or has errors."""
        if not isinstance(system, System):
            system, _ = load_file(Path(system), arguments or {}, settings or {})
        self._tested = system
        self._system = with_tester(system)
        self._seed = seed
        self._is_real = real_time
        self._start_ns = start_ns
        self._log_level = log_level
        self._record_to = record_to
        #: What became of the bag: its size and its folder, and what is missing in it.
        self.recorded: list[str] = []
        self._resources = ExitStack()
        self._observation = Observation(lambda: self._run.now_s)
        self._run: SystemRun
        self._faults: Faults
        self._tester: Tester

    def __enter__(self) -> Self:
        """Bring the system up.

        Raises StartRefused if it cannot run here, TestFailure, and BagError.
        """
        clock: Clock = COMPUTER if self._is_real else VirtualClock(start_ns=self._start_ns)
        tester = self._system.node(TESTER)
        ports = () if tester is None else tester.ports
        self._faults = Faults(clock, ports, self._on_tester)
        with ExitStack() as resources:
            recording = None if self._record_to is None else self._recording(self._record_to, clock)
            if recording is not None:
                resources.enter_context(recording.running())
            options = HostOptions(
                log_level=self._log_level,
                clock=clock,
                seed=self._seed,
                instruments=self._faults,
                recorder=recording,
            )
            self._run = SystemRun(self._system, options, self._observation.on_event)
            self._run.start(lambda: self._observation.is_up)
            if self.outcome is not None:
                raise self._failure("the system did not come up")
            self._resources = resources.pop_all()
        return self

    def _recording(self, folder: Path, clock: Clock) -> SystemRecording:
        return SystemRecording(self._system, Recording(), clock, self.recorded.append, folder)

    def __exit__(self, *_: object) -> None:
        """Shut the system down. Raises TestFailure if it does not end."""
        with self._resources:
            self._run.end()

    # --- time

    @property
    def now_s(self) -> float:
        """The seconds since the start of the run."""
        return self._run.now_s

    def advance(self, seconds: float) -> None:
        """Let the system run for this time."""
        self._run.clock.sleep(seconds)

    def run_until(self, condition: Callable[[], object], timeout_s: float) -> None:
        """Let the system run until ``condition()``, which is checked after each of its steps.

        Raises TestFailure after ``timeout_s``, and what ``condition`` raises.
        """
        if not self._run.wait(condition, timeout_s):
            raise self._failure(unmet(condition, timeout_s))

    # --- what the system does

    @property
    def states(self) -> Mapping[str, str]:
        """The lifecycle states of the nodes, by their keys in the file."""
        nodes = self._run.host.nodes.items()
        return {name: node.state for name, node in nodes if name != TESTER}

    @property
    def log(self) -> Sequence[LogLine]:
        """The lines of the log so far."""
        return tuple(self._observation.log)

    @property
    def events(self) -> Sequence[Event]:
        """What was reported so far, except for lines of the log."""
        return tuple(self._observation.events)

    @property
    def history(self) -> Sequence[Received | Answer | LogLine | Event]:
        """Everything so far in one order: messages, answers to the test, log lines and events."""
        return self._observation.history

    @property
    def latencies(self) -> Mapping[str, ChainFigures]:
        """The latencies of the chains so far, by their names."""
        return {figures.chain: figures for figures in self._run.host.chains()}

    @property
    def outcome(self) -> Outcome | None:
        """How the run has ended; None while it lasts."""
        return self._run.outcome

    def messages(self, topic: str) -> Sequence[Received]:
        """Return the messages on a topic so far.

        Raises TestFailure for a topic that no node publishes.
        """
        self._port(PortKind.SUBSCRIPTION, topic)
        return tuple(self._observation.messages.get(topic, ()))

    def timeline(self, until_s: float = inf) -> list[str]:
        """Return the last events, messages and log lines until a time, each with its time."""
        return self._observation.timeline.lines(until_s)

    # --- waiting for what runs on a loop

    def wait_for(self, future: Future[T], timeout_s: float, what: str) -> T:
        """Let the system run until the future is done; return its result.

        Raises TestFailure after ``timeout_s``, and the exception of the future.
        """
        if not self._run.wait(future.done, timeout_s):
            future.cancel()
            raise self._failure(f"waited {timeout_s:g} s for {what}")
        return future.result()

    def _run_on(
        self, node: ManagedNode, coroutine: Coroutine[Any, Any, T], timeout_s: float, what: str
    ) -> T:
        return self.wait_for(node.loop.run_task(coroutine), timeout_s, what)

    def _on_tester(self, tester: Tester) -> None:
        self._tester = tester
        tester.on_message = self._observation.on_message

    # --- names

    def _node(self, name: str) -> ManagedNode:
        nodes = {key: node for key, node in self._run.host.nodes.items() if key != TESTER}
        by_name = {node.full_name: node for node in nodes.values()} | nodes
        if name not in by_name:
            raise unknown(f"the system has no node '{name}'", name, nodes)
        return by_name[name]

    def _port(self, kind: PortKind, full_name: str) -> str:
        return port_to(self._run.host.nodes[TESTER].model, kind, full_name)

    def _failure(self, text: str) -> TestFailure:
        if self.outcome is not None:
            text = f"{text}; the system has ended: {self.outcome.reason}"
        return TestFailure(text, self.timeline())
