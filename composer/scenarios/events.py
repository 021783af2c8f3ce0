"""Finds the events that a condition describes in what a run has reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

from composer.language.expressions import EvaluationError, Expression, compile_expression
from composer.language.templates import evaluate
from composer.model import PrimaryState
from composer.model.scenario import Condition, EventKind
from composer.runtime.ros.messages import to_plain
from composer.runtime.supervision.events import Event, StateChanged
from composer.testing.failures import LogLine, Received, short
from composer.testing.system_run import Answer

Entry: TypeAlias = "Received | Answer | LogLine | Event"
#: The fields of a time, which an expression has in seconds.
_TIME = {"sec", "nanosec"}
_NUMBERS = (int, float)


def time_of(entry: Entry) -> float:
    """Return the seconds since the start of the run."""
    return entry.elapsed_s if hasattr(entry, "elapsed_s") else entry.time_s


class Matcher:
    """Finds the events of one condition in the entries of a history, one by one.

    ``keys`` are the keys of the nodes by their full names. Times in expressions count from
    ``start_s``.
    """

    def __init__(self, condition: Condition, keys: Mapping[str, str], start_s: float) -> None:
        self._condition = condition
        self._keys = keys
        self._start_s = start_s
        self._states = dict.fromkeys(keys.values(), str(PrimaryState.UNCONFIGURED))
        #: The last message, answer or log line of the right name or node that is not such an event.
        self.other: Received | Answer | LogLine | None = None
        self._explain: Callable[[], str] = str
        self._describe: Callable[[], str] = str

    @property
    def states(self) -> Mapping[str, str]:
        """The states of all nodes after the last entry, by key."""
        return self._states

    @property
    def holds(self) -> bool:
        """Whether the nodes have the states of the condition, if it is about states."""
        wanted = self._condition.states
        return bool(wanted) and all(self._states.get(name.value) == to for name, to in wanted)

    def matches(self, entry: Entry) -> bool:
        """Return whether the next entry is such an event."""
        condition = self._condition
        if isinstance(entry, StateChanged):
            has_held = self.holds
            self._states[self._keys.get(entry.node, entry.node)] = entry.state
            return self.holds and not has_held
        if isinstance(entry, LogLine):
            return condition.kind is EventKind.LOG and self._is_line(entry)
        if isinstance(entry, Received):
            is_named = condition.kind is EventKind.MESSAGE and entry.topic == condition.name.value
            return is_named and self._is_right({"message": entry.message}, entry.message, entry)
        if isinstance(entry, Answer) and entry.name == condition.name.value:
            return self._is_answer(entry)
        return False

    def _is_line(self, line: LogLine) -> bool:
        condition = self._condition
        is_of_node = condition.node is None or self._keys.get(line.node) == condition.node.value
        is_right = condition.level in (None, line.level) and condition.name.value in line.text
        if is_of_node and not is_right:
            return self._differs(line, lambda: f"[{line.level.upper()}] {short(line.text)}")
        return is_of_node

    def _is_answer(self, answer: Answer) -> bool:
        message, kind = answer.message, self._condition.kind
        if kind is EventKind.RESULT:
            scope = {"result": message, "status": answer.status}
        elif kind is EventKind.RESPONSE and message is not None:
            scope = {"response": message}
        else:
            is_awaited = kind is EventKind.RESPONSE
            return is_awaited and self._differs(answer, lambda: f"it {answer.status}")
        return self._is_right(scope, message, answer)

    def _is_right(self, scope: dict[str, Any], message: Any, entry: Received | Answer) -> bool:
        condition = self._condition
        scope["now"] = entry.time_s - self._start_s
        if condition.where is not None:
            expression = condition.where.value
            try:
                is_right = expression.holds(scope)
            except EvaluationError as error:
                reason = str(error)
                return self._differs(entry, lambda: reason)
            if not is_right:
                return self._differs(entry, lambda: ", ".join(_values(expression, scope)))
            self._describe = lambda: ", ".join(_values(expression, scope))
        if condition.fields is not None:
            wanted = evaluate(condition.fields, scope)
            differences = _differences(wanted, message, condition.tolerance)
            wrong = next(differences, None)
            return wrong is None or self._differs(entry, lambda: wrong)
        return True

    def _differs(self, entry: Received | Answer | LogLine, explain: Callable[[], str]) -> bool:
        self.other, self._explain = entry, explain
        return False

    @property
    def values(self) -> str:
        """The values in the last event that met ``where``; empty without ``where``."""
        return self._describe()

    @property
    def difference(self) -> str:
        """How :attr:`other` differs from the condition."""
        return self._explain()


def _values(expression: Expression, scope: Mapping[str, Any]) -> Iterator[str]:
    """Yield what the parts of an expression are: ``message.linear.x is 0.5``."""
    for path in dict.fromkeys(map(str, expression.paths)):
        try:
            value = compile_expression(path).evaluate(scope)
        except EvaluationError as error:
            yield str(error)
        else:
            yield f"{path} is {_shown(value)}"


def _differences(wanted: Any, found: Any, tolerance: float, path: str = "") -> Iterator[str]:
    """Yield the fields in which a message differs from the wanted values."""
    if isinstance(wanted, dict):
        for name, value in wanted.items():
            inner = getattr(found, name, None)
            yield from _differences(value, inner, tolerance, f"{path}.{name}".lstrip("."))
        return
    found = to_plain(found)
    if isinstance(found, dict) and found.keys() == _TIME:
        found = found["sec"] + found["nanosec"] / 1e9
    if isinstance(wanted, list) and isinstance(found, list) and len(wanted) == len(found):
        pairs = enumerate(zip(wanted, found, strict=True))
        is_near = all(_is_near(value, inner, tolerance) for _, (value, inner) in pairs)
    else:
        is_near = _is_near(wanted, found, tolerance)
    if not is_near:
        yield f"{path} is {_shown(found)}, not {_shown(wanted)}"


def _is_near(wanted: Any, found: Any, tolerance: float) -> bool:
    is_number = isinstance(wanted, _NUMBERS) and isinstance(found, _NUMBERS)
    if not is_number or isinstance(wanted, bool):
        return bool(wanted == found)
    return bool(found == wanted or abs(found - wanted) <= tolerance)


def _shown(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else short(to_plain(value))
