"""Parameters of all nodes: ``/planning/planner.max_velocity`` is one of ``/planning/planner``."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from typing import TYPE_CHECKING, Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.channels.parameters import MAX_EVENTS, parameter_events
from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.encoding import ERROR
from composer.dashboard.foxglove.link import Link, error_text
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values, to_json
from composer.dashboard.protocol.outbox import Delivery, Update
from composer.dashboard.web.client import Running

if TYPE_CHECKING:
    from composer.client.parameters import ParameterClient
    from composer.client.session import Deadline
    from composer.client.shared_session import SampledTopic
    from composer.dashboard.observing.ros_graph import RosGraph

_PARAMETERS_S = 5.0
_MAX_ITEMS = 10_000


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter that a client sets, to None if it deletes it."""

    node: str
    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class _Answer:
    """Parameters as they are sent, and what went wrong."""

    parameters: list[dict[str, Any]]
    problems: list[str]


class Parameters:
    """The parameters of all nodes, for one client."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._names: set[str] = set()
        self._has_all = False
        self._events: Running | None = None

    def read(self, values: Values) -> None:
        """Send the parameters that a message requests. Raises RequestError."""
        names = values.texts("parameterNames", _MAX_ITEMS)
        self._request(values.optional_text("id"), lambda ros, limit: _read_all(ros, limit, names))

    def set(self, values: Values) -> None:
        """Set parameters as a message requests. Raises RequestError."""
        self._link.check_may_change("setting parameters")
        settings = [read_setting(item) for item in values.items("parameters", _MAX_ITEMS)]
        identifier = values.optional_text("id")
        self._request(
            identifier,
            lambda ros, limit: _set_all(ros, limit, settings),
            is_answered=identifier is not None,
        )

    def subscribe(self, values: Values) -> None:
        """Send parameters whenever they change, all without names. Raises RequestError."""
        names = values.texts("parameterNames", _MAX_ITEMS)
        if len(self._names) + len(names) > _MAX_ITEMS:
            raise RequestError("too_many", f"{_MAX_ITEMS} parameters are the limit")
        new = set(names) - self._names
        self._link.outbox.budget.take(_size(new))
        self._names |= new
        self._has_all |= not names
        if self._events is None:
            self._events = self._link.follow("parameters", _ParameterEvents(), self._on_change)

    def unsubscribe(self, values: Values) -> None:
        """Send parameters no longer, none at all without names. Raises RequestError."""
        names = values.texts("parameterNames", _MAX_ITEMS)
        gone = self._names & set(names) if names else self._names
        self._link.outbox.budget.give(_size(gone))
        self._names -= gone
        self._has_all &= bool(names)
        if not self._names and not self._has_all:
            self.end()

    def end(self) -> None:
        """Receive changes no longer."""
        if self._events is not None:
            self._link.stop(self._events)
            self._events = None

    def _request(
        self,
        identifier: str | None,
        run: Callable[[RosGraph, Deadline], _Answer],
        *,
        is_answered: bool = True,
    ) -> None:
        def done(answer: _Answer) -> None:
            for problem in answer.problems:
                self._link.say(ERROR, problem)
            content = {"op": "parameterValues", "parameters": answer.parameters}
            if is_answered:
                self._link.post(content if identifier is None else content | {"id": identifier})

        self._link.request(run, _PARAMETERS_S, done, self._link.refuse)

    def _on_change(self, update: Update) -> None:
        changed = [
            item for item in json.loads(update.data) if self._has_all or item["name"] in self._names
        ]
        if changed:
            self._link.post({"op": "parameterValues", "parameters": changed})


def _size(names: Iterable[str]) -> int:
    return sum(map(len, names))


class _ParameterEvents(Feed):
    """The parameters that change, of all nodes."""

    period_s = 0.1
    delivery = Delivery.QUEUE

    def __init__(self) -> None:
        self._events: SampledTopic

    def start(self) -> None:
        """Subscribe to announcements of changes."""
        self._events = parameter_events(self.ros)
        self.resources.callback(self._events.close)

    def poll(self) -> Iterator[Update]:
        """Yield the parameters that have changed."""
        from composer.runtime.ros.parameter_values import plain_value

        changed: dict[str, Any] = {}
        for sample in self._events.take(MAX_EVENTS):
            event = sample.content
            for item in (*event.new_parameters, *event.changed_parameters):
                changed[_full_name(event.node, item.name)] = plain_value(item.value)
            for item in event.deleted_parameters:
                changed[_full_name(event.node, item.name)] = None
        if changed:
            yield Update(to_json([parameter(*item) for item in changed.items()]))


def parameter(name: str, value: Any) -> dict[str, Any]:
    """Return a parameter as it is sent; without a value if it is not set."""
    if value is None:
        return {"name": name}
    # In JavaScript, 1.0 and 1 are the same number.
    if isinstance(value, float):
        return {"name": name, "value": value, "type": "float64"}
    if isinstance(value, list) and value and all(isinstance(item, float) for item in value):
        return {"name": name, "value": value, "type": "float64_array"}
    return {"name": name, "value": value}


def read_setting(item: Any) -> Setting:
    """Return what a client sets. Raises BadRequestError."""
    if not isinstance(item, Mapping) or not isinstance(item.get("name"), str):
        raise BadRequestError("each item of 'parameters' must be an object with a string 'name'")
    node, name = _split(item["name"])
    if not name:
        raise BadRequestError(f"'{item['name']:.80}' must have the form /node.parameter")
    return Setting(node, name, _value(item))


def _full_name(node: str, name: str) -> str:
    """Return the name of a parameter among those of all nodes."""
    return f"{node}.{name}"


def _read_all(ros: RosGraph, deadline: Deadline, names: Iterable[str]) -> _Answer:
    """Return the parameters with these names, those of all nodes without any."""
    by_node: dict[str, list[str]] = {}
    for name in names:
        node, last = _split(name)
        by_node.setdefault(node, []).append(last)
    if not by_node:
        return _read_everything(ros, deadline)
    return _for_each(by_node, ros, deadline, _read)


def _set_all(ros: RosGraph, deadline: Deadline, settings: Iterable[Setting]) -> _Answer:
    """Set parameters one by one, and return their values then."""
    by_node: dict[str, list[Setting]] = {}
    for setting in settings:
        by_node.setdefault(setting.node, []).append(setting)
    return _for_each(by_node, ros, deadline, _set)


def _read_everything(ros: RosGraph, deadline: Deadline) -> _Answer:
    from composer.client.snapshot import GraphObserver

    # Nodes that have just ended would be waited for.
    present = {name for name, _ in ros.session.graph.names("node")}
    nodes = {name: ends for name, ends in ros.known().nodes.items() if name in present}
    with GraphObserver(ros.session) as observer:
        found = observer.parameters(nodes, deadline)
    parameters = [
        parameter(_full_name(node, name), value)
        for node in sorted(found)
        for name, value in (found[node] or {}).items()
    ]
    silent = [node for node in sorted(found) if found[node] is None]
    problems = [f"no parameters of {', '.join(silent)}: no response"] if silent else []
    return _Answer(parameters, problems)


def _for_each(by_node: Mapping[str, Any], ros: RosGraph, deadline: Deadline, act: Any) -> _Answer:
    from composer.client.parameters import ParameterClient
    from composer.client.session import RosError

    answer = _Answer([], [])
    for node, items in by_node.items():
        try:
            with closing(ParameterClient(ros.session, deadline, node)) as client:
                act(client, items, answer)
        except RosError as error:
            answer.problems.append(error_text(error))
    return answer


def _read(client: ParameterClient, names: Iterable[str], answer: _Answer) -> None:
    values = _values(client, names)
    answer.parameters.extend(
        parameter(_full_name(client.node, name), value) for name, value in values.items()
    )
    answer.problems.extend(
        f"{client.node} has no parameter '{name:.80}'" for name in names if name not in values
    )


def _set(client: ParameterClient, settings: list[Setting], answer: _Answer) -> None:
    from composer.client.session import RosError

    for setting in settings:
        try:
            if setting.value is None:
                client.delete(setting.name)
            else:
                client.set({setting.name: setting.value})
        except RosError as error:
            answer.problems.append(error_text(error))
    names = dict.fromkeys(setting.name for setting in settings)
    values = _values(client, names)
    answer.parameters.extend(
        parameter(_full_name(client.node, name), values.get(name)) for name in names
    )


def _values(client: ParameterClient, names: Iterable[str]) -> Mapping[str, Any]:
    """Return the values of the parameters that the node has."""
    known = client.names()
    wanted = [name for name in names if name in known]
    return client.values(wanted) if wanted else {}


def _split(name: str) -> tuple[str, str]:
    """Return the node and the name of its parameter; names of nodes have no dots."""
    node, _, last = name.partition(".")
    return node, last


def _value(item: Mapping[str, Any]) -> Any:
    """Return the value of an item of a client. Raises BadRequestError."""
    value, kind, name = item.get("value"), item.get("type"), item["name"]
    if kind == "byte_array" and isinstance(value, str):
        try:
            return list(base64.b64decode(value, validate=True))
        except (binascii.Error, ValueError) as error:
            raise BadRequestError(f"the value of '{name:.80}' is not base64") from error
    is_float = kind in ("float64", "float64_array")
    if isinstance(value, list):
        return [_scalar(entry, name, is_float=is_float) for entry in value]
    return _scalar(value, name, is_float=is_float)


def _scalar(value: Any, name: str, *, is_float: bool) -> Any:
    if is_float and type(value) is int:
        try:
            return float(value)
        except OverflowError as error:
            raise BadRequestError(f"the value of '{name:.80}' is too large") from error
    if type(value) is int and not -(2**63) <= value < 2**63:
        raise BadRequestError(f"the value of '{name:.80}' is not an integer of 64 bits")
    if value is not None and not isinstance(value, bool | int | float | str):
        raise BadRequestError(f"the value of '{name:.80}' must be a number, text, or array of them")
    return value
