"""Runs one scenario in this process."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import field, replace
from functools import partial
from itertools import zip_longest
from math import inf
from pathlib import Path
from typing import Any
from zlib import crc32

from composer.bags.bag import BagError
from composer.base.fast_dataclass import dataclass
from composer.language.expressions import EvaluationError
from composer.language.templates import evaluate
from composer.model import LogLevel, System
from composer.model.scenario import (
    Action,
    Condition,
    EventKind,
    Expectation,
    Replay,
    Scenario,
    Step,
    Verb,
)
from composer.runtime.executors.futures import Future
from composer.runtime.process import StartRefused
from composer.runtime.ros.messages import MessageError, convert_message, to_plain
from composer.scenarios.events import Entry, Matcher, time_of
from composer.scenarios.expectations import Failure, Record, check, described
from composer.testing.failures import LogLine, Received, TestFailure, short
from composer.testing.goals import Goal
from composer.testing.system_run import Answer
from composer.testing.system_test import SystemTest

#: Times may differ in the last digits: they are sums.
_EPSILON_S = 1e-6
_ERRORS = (LogLevel.ERROR, LogLevel.FATAL)


@dataclass(slots=True)
class Result:
    """How a scenario went.

    ``timeline`` are the last events before the first failure, ``output`` is what the process of a
    run that failed has printed, ``recorded`` what became of its bag. ``trace`` has the time and a
    checksum of all that the run reported. ``disturbable`` is how many messages and calls faults
    could have acted on, by topic and timer.

    Of an exploration, this is the result of the smallest variation that fails, or of the scenario
    itself: ``explored`` is the number of variations, ``variation`` the smallest one as text.
    """

    failures: list[Failure] = field(default_factory=list)
    timeline: list[str] = field(default_factory=list)
    took_s: float = 0.0
    output: str = ""
    recorded: list[str] = field(default_factory=list)
    trace: list[tuple[float, int]] = field(default_factory=list)
    disturbable: dict[str, int] = field(default_factory=dict)
    explored: int = 0
    variation: str = ""


@dataclass(frozen=True, slots=True)
class Options:
    """How scenarios are run. ``seed`` takes precedence over the seeds of the scenarios.

    With ``traced``, the results have a trace, so that runs can be compared.
    """

    real_time: bool = False
    seed: int | None = None
    traced: bool = False


def run_scenario(
    scenario: Scenario, system: System, options: Options, bag: Path | None = None
) -> Result:
    """Run a scenario with its system, once. ``bag`` is the folder of a new bag for the run."""
    started_s = time.monotonic()
    seed = scenario.seed if options.seed is None else options.seed
    system = in_one_process(system)
    test = SystemTest(system, seed=seed, real_time=options.real_time, record_to=bag)
    run = _Run(scenario, system, test)
    result = Result()
    try:
        with test:
            before = test.disturbable
            result.failures += run.run()
            for name, number in test.disturbable.items():
                result.disturbable[name] = number - before.get(name, 0)
            if result.failures:
                result.timeline = test.timeline(result.failures[0].until_s + _EPSILON_S)
        result.failures += run.end()
        if options.traced:
            result.trace = [(time_of(entry), crc32(_text(entry))) for entry in test.history]
        if result.failures and not result.timeline:
            result.timeline = test.timeline(result.failures[0].until_s + _EPSILON_S)
    except (StartRefused, TestFailure, BagError) as error:
        result.failures.append(Failure(scenario.name.span, "a run of the system", str(error)))
    result.recorded = test.recorded
    result.took_s = time.monotonic() - started_s
    return result


def difference(scenario: Scenario, first: Result, other: Result) -> Failure | None:
    """Return where two runs with the same seed differ, or None."""
    for pair in zip_longest(first.trace, other.trace):
        if pair[0] != pair[1]:
            since_s = min(entry[0] for entry in pair if entry is not None)
            seen = f"other ones from {since_s:.3f} s on: something depends on more than the seed"
            return Failure(scenario.name.span, "the events of the first run", seen)
    return None


def _text(entry: Entry) -> bytes:
    """Return an entry as text, with the fields of its message."""
    if isinstance(entry, Received | Answer):
        entry = replace(entry, message=to_plain(entry.message))
    return repr(entry).encode()


def in_one_process(system: System) -> System:
    """Return a system whose nodes all run in this process."""
    nodes = tuple(replace(node, process=None) for node in system.nodes)
    return replace(system, nodes=nodes, processes=(), hosts=(), discovery=None)


class _Stopped(Exception):
    """A step failed: those after it cannot be made."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.seen)
        self.failure = failure


class _Run:
    def __init__(self, scenario: Scenario, system: System, test: SystemTest) -> None:
        self._scenario = scenario
        self._test = test
        self._keys = {node.full_name: node.name.value for node in system.nodes}
        self._goals: dict[str, Goal] = {}
        self._replays: list[tuple[Action, Future[None]]] = []
        self._start_s = 0.0

    def run(self) -> Iterator[Failure]:
        """Make the steps, run to the end, and yield what was not met."""
        test, scenario = self._test, self._scenario
        self._start_s = test.now_s
        waiting: list[tuple[Expectation, int, float]] = []
        stopped: Failure | None = None
        try:
            for step in scenario.steps:
                self._wait_until_due(step)
                first, now_s = len(test.history), test.now_s
                waiting += [(item, first, now_s) for item in step.expectations]
                for action in step.actions:
                    self._act(action)
        except _Stopped as error:
            stopped = error.failure
        else:
            self._advance_to(scenario.for_s.value + _EPSILON_S)  # with what is due at the end
        # What is reported after the end belongs to the tear-down.
        history, end_s = list(test.history), self._start_s + scenario.for_s.value
        record = Record(history, self._keys, self._start_s, end_s, test.latencies)
        if stopped is not None:
            yield stopped
            return
        problems = ((action, replay.exception()) for action, replay in self._replays)
        yield from (_broken(action, str(problem)) for action, problem in problems if problem)
        waiting += [(item, 0, self._start_s) for item in scenario.expectations]
        for expectation, first, now_s in waiting:
            failure = check(expectation, record, first, now_s)
            if failure is not None:
                yield failure

    def end(self) -> Iterator[Failure]:
        """Yield what was wrong with the end of the run, after it."""
        scenario, outcome = self._scenario, self._test.outcome
        span = scenario.name.span
        if outcome is not None and outcome.exit_code != scenario.exit_code:
            seen = ", ".join([f"{outcome.exit_code}: {outcome.reason}", *outcome.remarks])
            yield Failure(span, f"exit code {scenario.exit_code}", seen)
        expected = [event for event in scenario.conditions if event.kind is EventKind.LOG]
        matchers = [Matcher(event, self._keys, self._start_s) for event in expected]
        errors = [
            line
            for line in self._test.log
            if line.level in _ERRORS and not any(item.matches(line) for item in matchers)
        ]
        if errors and not scenario.allow_errors:
            seen = _errors(errors, self._start_s)
            yield Failure(span, "no errors in the log", seen, errors[0].time_s)

    def _wait_until_due(self, step: Step) -> None:
        if step.at_s is not None:
            self._advance_to(step.at_s.value)
        if step.when is not None:
            self._wait_for(step.when)
        self._advance_to(self._test.now_s - self._start_s + step.after_s)

    def _advance_to(self, time_s: float) -> None:
        missing_s = self._start_s + time_s - self._test.now_s
        if missing_s > 0:
            self._test.advance(missing_s)

    def _wait_for(self, event: Condition) -> None:
        matcher = Matcher(event, self._keys, self._start_s)
        history = self._test.history
        for entry in history:  # as for the states of the nodes
            matcher.matches(entry)
        read, is_done = len(history), matcher.holds

        def has_happened() -> bool:
            nonlocal read, is_done
            while read < len(history) and not is_done:
                is_done = matcher.matches(history[read])
                read += 1
            return is_done

        end_s = self._start_s + self._scenario.for_s.value
        with suppress(TestFailure):
            self._test.run_until(has_happened, end_s - self._test.now_s)
            return
        seen = "none until the end of the run"
        if matcher.other is not None:
            time_s = matcher.other.time_s - self._start_s
            seen = f"{seen}; the last {event.kind}, at {time_s:.3f} s: {matcher.difference}"
        wanted = f"{described(event)}, for the next step"
        raise _Stopped(Failure(event.span, wanted, seen, end_s))

    def _act(self, action: Action) -> None:
        try:
            self._do(action)
        except (TestFailure, MessageError, EvaluationError, BagError) as error:
            text = error.text if isinstance(error, TestFailure) else str(error)
            raise _Stopped(_broken(action, text, self._test.now_s)) from error

    def _do(self, action: Action) -> None:
        test, name = self._test, action.name.value
        value = None if action.value is None else action.value.value
        options: dict[str, Any] = {key: item.value for key, item in action.options.items()}
        match action.verb:
            case Verb.PUBLISH | Verb.CALL | Verb.SEND_GOAL:
                self._send(action)
            case Verb.CANCEL:
                self._goals[name].cancel()
            case Verb.SET_PARAMETER:
                node, _, parameter = name.partition(".")
                test.set_parameter(node, parameter, value)
            case Verb.TRANSITION:
                test.transition(name, str(value))
            case Verb.DELAY:
                test.delay(name, options.pop("by_s"), **options)
            case Verb.DELAY_TIMER:
                node, _, timer = name.partition(".")
                test.delay_timer(node, timer, options.pop("by_s"), **options)
            case Verb.CORRUPT:
                test.corrupt(name, partial(self._corrupted, action), **options)
            case Verb.REPLAY if action.replay is not None:
                self._replay(action, action.replay)
            case Verb.HANG:
                test.hang(name, options["for_s"], options.get("handler"))
            case _:  # drop, duplicate, reorder, raise_in, kill
                getattr(test, action.verb)(name, **options)

    def _replay(self, action: Action, replay: Replay) -> None:
        topics = [topic.value for topic in replay.topics]
        start_s = 0.0 if replay.start_s is None else replay.start_s.value
        played = self._test.replay(replay.bag, topics, start_s, replay.duration_s)
        self._replays.append((action, played))

    def _send(self, action: Action) -> None:
        test, name = self._test, action.name.value
        scope = {"now": test.now_s - self._start_s}
        content = {} if action.content is None else evaluate(action.content, scope)
        if action.verb is Verb.PUBLISH:
            test.publish(name, content)
        elif action.verb is Verb.CALL:
            test.call_soon(name, content, inf)
        else:
            self._goals[name] = test.send_goal(name, content)

    def _corrupted(self, action: Action, message: Any) -> Any:
        """Return a message with other values of the fields that a step sets."""
        scope = {"message": message, "now": self._test.now_s - self._start_s}
        values = {} if action.content is None else evaluate(action.content, scope)
        changed = _updated(to_plain(message), values)
        return convert_message(changed, type(message), action.name.value)


def _broken(action: Action, text: str, until_s: float = inf) -> Failure:
    """Return the failure of a step that could not be made."""
    return Failure(action.name.span, f"'{action.verb}' to work", text, until_s)


def _updated(content: Any, values: Any) -> Any:
    """Return the content of a message with other values of some fields."""
    if not isinstance(content, dict) or not isinstance(values, dict):
        return values
    inner = {name: _updated(content.get(name), value) for name, value in values.items()}
    return {**content, **inner}


def _errors(lines: list[LogLine], start_s: float) -> str:
    """Return the first of some lines of the log, and how many there are."""
    first = lines[0]
    text = f"at {first.time_s - start_s:.3f} s, {first.node}: {short(first.text)}"
    return text if len(lines) == 1 else f"{len(lines)}, the first {text}"
