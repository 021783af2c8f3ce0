"""Compares what a run has reported with what a scenario expects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from math import inf

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.model.scenario import Condition, EventKind, Expectation, ExpectationKind, States
from composer.runtime.protocol.reports import ChainFigures
from composer.runtime.supervision.events import StateChanged
from composer.scenarios.events import Entry, Matcher, time_of

#: Times may differ in the last digits: they are sums.
_EPSILON_S = 1e-6
_MAX_NAMED = 5
#: What was expected, what was seen, and when that was clear, if before the end of the window.
Difference = tuple[str, str] | tuple[str, str, float] | None


@dataclass(frozen=True, slots=True)
class Failure:
    """An expectation that was not met, at its place in the scenario, and what happened instead.

    ``until_s`` is when that was clear, in the time of the entries.
    """

    span: Span
    expected: str
    seen: str
    until_s: float = inf


@dataclass(frozen=True, slots=True)
class Record:
    """What a run has reported.

    ``keys`` are the keys of the nodes by their full names. The scenario begins at ``start_s`` and
    ends at ``end_s``, in the time of the entries.
    """

    history: Sequence[Entry]
    keys: Mapping[str, str]
    start_s: float
    end_s: float
    chains: Mapping[str, ChainFigures]

    def matcher(self, condition: Condition) -> Matcher:
        """Return a matcher for all entries of the record."""
        return Matcher(condition, self.keys, self.start_s)


@dataclass(frozen=True, slots=True)
class Window:
    """The part of a record that counts: from an entry, and between two times."""

    first: int
    start_s: float
    end_s: float


def check(
    expectation: Expectation, record: Record, first: int = 0, base_s: float | None = None
) -> Failure | None:
    """Return how an expectation was not met, or None.

    ``first`` and ``base_s`` are the next entry and the time of the step that expects it; by
    default, all of the run counts, with the bring-up.
    """
    base_s = record.start_s if base_s is None else base_s
    until_s = expectation.until_s
    window = Window(
        first,
        base_s + expectation.after_s if expectation.after_s else 0.0,
        record.end_s if until_s is None else base_s + until_s.value,
    )
    match expectation.kind:
        case ExpectationKind.RATE:
            found = _rate(expectation, record, window, base_s)
        case ExpectationKind.SILENCE:
            found = _silence(expectation, record, window)
        case ExpectationKind.ORDER:
            found = _order(expectation, record, window)
        case ExpectationKind.LATENCY:
            found = _latency(expectation, record)
        case ExpectationKind.END_STATE:
            found = _end_state(expectation.states, record)
        case _:
            found = _count(expectation, record, window)
    if found is None:
        return None
    wanted, seen, *clear_s = found
    return Failure(expectation.span, wanted, seen, *clear_s or [window.end_s])


def _matches(
    matcher: Matcher, record: Record, window: Window, *, at_start: bool = True
) -> Iterator[tuple[int, float]]:
    """Yield the entries in the window that match, with their times.

    With ``at_start``, states that nodes have at its beginning match at once.
    """
    has_begun = False
    for index, entry in enumerate(record.history):
        time_s = time_of(entry)
        if time_s > window.end_s + _EPSILON_S:
            return
        is_in = index >= window.first and time_s >= window.start_s - _EPSILON_S
        if is_in and not has_begun:
            has_begun = True
            if matcher.holds and at_start:
                yield index - 1, max(window.start_s, record.start_s)
        if (is_in or isinstance(entry, StateChanged)) and matcher.matches(entry) and is_in:
            yield index, time_s
    if matcher.holds and at_start and not has_begun:
        yield len(record.history), max(window.start_s, record.start_s)


def _count(expectation: Expectation, record: Record, window: Window) -> Difference:
    [event] = expectation.events
    matcher = record.matcher(event)
    times = [time_s for _, time_s in _matches(matcher, record, window)]
    least, most = expectation.limit("at_least"), expectation.limit("at_most")
    if len(times) >= (least or 1) and (most is None or len(times) <= most):
        return None
    limits = _limits(least, most)
    wanted = described(event) + (f", {limits} times" if limits else "")
    seen = _seen(event, matcher, times, record, window)
    clear_s = window.end_s if most is None or len(times) <= most else times[int(most)]
    return f"{wanted}{_when(expectation)}", seen, clear_s


def _seen(
    event: Condition, matcher: Matcher, times: Sequence[float], record: Record, window: Window
) -> str:
    """Return which events there were: of those that match, or else similar or late ones."""
    if times:
        seconds = ", ".join(f"{_since(time_s, record)} s" for time_s in times[:_MAX_NAMED])
        more = ", ..." if len(times) > _MAX_NAMED else ""
        return f"{len(times)}, at {seconds}{more}"
    seen = "none"
    if event.states:
        seen = _states_text({name.value: matcher.states[name.value] for name, _ in event.states})
        seen = f"{seen} at {_since(window.end_s, record)} s"
    elif matcher.other is not None:
        seen = f"none; the last {_other(matcher, event, record)}"
    after_s = window.end_s + 2 * _EPSILON_S
    later = _matches(record.matcher(event), record, Window(0, after_s, inf), at_start=False)
    match = next(later, None)
    if match is not None:
        return f"{seen}; the next one at {_since(match[1], record)} s"
    if matcher.other is None:
        for entry in record.history:
            if time_of(entry) > after_s and not matcher.matches(entry) and matcher.other:
                return f"{seen} in that time; the next {_other(matcher, event, record)}"
    return seen


def _other(matcher: Matcher, event: Condition, record: Record) -> str:
    """Return the time of a similar event, and how it differs."""
    if matcher.other is None:
        return ""
    what = "line" if event.kind is EventKind.LOG else event.kind
    return f"{what}, at {_since(matcher.other.time_s, record)} s: {matcher.difference}"


def _rate(expectation: Expectation, record: Record, window: Window, base_s: float) -> Difference:
    [event] = expectation.events
    start_s = base_s + expectation.after_s
    lasting_s = window.end_s - start_s
    window = Window(window.first, start_s + 2 * _EPSILON_S, window.end_s)  # without its start
    count = sum(1 for _ in _matches(record.matcher(event), record, window))
    rate_hz = count / lasting_s if lasting_s > 0 else 0.0
    least, most = expectation.limit("at_least_hz"), expectation.limit("at_most_hz")
    if rate_hz >= (least or 0.0) - _EPSILON_S and (most is None or rate_hz <= most + _EPSILON_S):
        return None
    limits = _limits(least, most)
    seen = f"{rate_hz:.4g} Hz, {count} messages in {lasting_s:g} s"
    return f"{limits} Hz on {event.name}{_where(event)}", seen


def _silence(expectation: Expectation, record: Record, window: Window) -> Difference:
    [event] = expectation.events
    start_s = record.start_s if window.first == 0 else window.start_s
    window = Window(window.first, max(start_s, window.start_s), window.end_s)
    matcher = record.matcher(event)
    matches = _matches(matcher, record, window)
    times = [time_s for _, time_s in islice(matches, 1)]
    if not times:
        return None
    first = f"; in the first one, {matcher.values}" if matcher.values else ""
    times += [time_s for _, time_s in matches]
    wanted = f"no message on {event.name}{_where(event)}{_when(expectation)}"
    return wanted, _seen(event, matcher, times, record, window) + first, times[0]


def _order(expectation: Expectation, record: Record, window: Window) -> Difference:
    done: list[str] = []
    last_s = 0.0
    for event in expectation.events:
        matcher = record.matcher(event)
        found = next(_matches(matcher, record, window, at_start=not done), None)
        if found is None:
            wanted = ", then ".join(described(item) for item in expectation.events)
            after = f"after {' and '.join(done)}, " if done else ""
            times = [at for _, at in _matches(record.matcher(event), record, Window(0, 0.0, inf))]
            seen = f"{after}no {described(event)}"
            clear_s = window.end_s
            if times:
                seen += f", only before, at {_since(times[-1], record)} s"
                clear_s = max(times[-1], last_s)
            return f"{wanted}{_when(expectation)}", seen, clear_s
        index, last_s = found
        done.append(f"{described(event)} at {_since(last_s, record)} s")
        window = Window(index + 1, window.start_s, window.end_s)
    return None


def _latency(expectation: Expectation, record: Record) -> Difference:
    name = "" if expectation.name is None else expectation.name.value
    figures = record.chains.get(name)
    if figures is None or not figures.count:
        return f"latencies of {name}", "no message went through the chain"
    most_ms = expectation.limit("at_most_ms") or figures.latency_ms
    if figures.longest_ms <= most_ms:
        return None
    return f"latencies of {name} of at most {most_ms:g} ms", figures.text


def _end_state(states: States, record: Record) -> Difference:
    condition = Condition(EventKind.STATE, states[0][0], states[0][0].span, states)
    matcher = record.matcher(condition)
    for entry in record.history:
        matcher.matches(entry)
    if matcher.holds:
        return None
    wanted = {name.value: state for name, state in states}
    seen = {name: matcher.states[name] for name in wanted}
    return f"{_states_text(wanted)} at the end", _states_text(seen)


def described(event: Condition) -> str:
    """Return an event in words: ``a message on /scan where message.data > 1``."""
    match event.kind:
        case EventKind.MESSAGE:
            text = f"a message on {event.name}"
        case EventKind.RESPONSE:
            text = f"a response of {event.name}"
        case EventKind.RESULT:
            text = f"a result of {event.name}"
        case EventKind.STATE:
            text = _states_text({name.value: state for name, state in event.states})
        case EventKind.LOG:
            level = "" if event.level is None else f" of level {event.level}"
            node = "" if event.node is None else f" of {event.node}"
            text = f"a line '{event.name}'{level} in the log{node}"
    return f"{text}{_where(event)}"


def _where(event: Condition) -> str:
    where = "" if event.where is None else f" where {event.where}"
    return f"{where} with these fields" if event.fields is not None else where


def _states_text(states: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {state}" for name, state in states.items())


def _limits(least: float | None, most: float | None) -> str:
    if least == most and least is not None:
        return f"exactly {least:g}"
    limits = (("at least", least), ("at most", most))
    return " and ".join(f"{word} {value:g}" for word, value in limits if value is not None)


def _when(expectation: Expectation) -> str:
    """Return the times that an expectation sets, counted from its step."""
    after = f" after {expectation.after_s:g} s" if expectation.after_s else ""
    until_s = expectation.until_s
    return after if until_s is None else f"{after} within {until_s.value:g} s"


def _since(time_s: float, record: Record) -> str:
    return f"{time_s - record.start_s:.3f}".rstrip("0").rstrip(".")
