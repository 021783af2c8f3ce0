"""Parameters of all nodes: ``/planning/planner.max_velocity`` is one of ``/planning/planner``."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from composer.base.fast_dataclass import dataclass
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import BadRequestError, to_json
from composer.dashboard.protocol.outbox import Delivery, Update
from composer.model.qos import QosProfile

if TYPE_CHECKING:
    from composer.client.parameters import ParameterClient
    from composer.client.session import Deadline
    from composer.client.shared_session import SampledTopic
    from composer.dashboard.ros_side import RosGraphSide

_EVENTS = "/parameter_events"
_EVENTS_TYPE = "rcl_interfaces/msg/ParameterEvent"
_EVENTS_PROFILE = QosProfile(depth=1000)
_MAX_EVENTS = 1000


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter that a client sets, to None if it deletes it."""

    node: str
    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class Found:
    """Parameters as they are sent, and what went wrong."""

    parameters: list[dict[str, Any]]
    problems: list[str]


class ParameterEvents(Feed):
    """The parameters that change, of all nodes."""

    period_s = 0.1
    delivery = Delivery.QUEUE

    def __init__(self) -> None:
        self._events: SampledTopic

    def start(self, ros: RosGraphSide) -> None:
        """Subscribe to announcements of changes."""
        self._events = ros.session.sample(_EVENTS, _EVENTS_TYPE, _EVENTS_PROFILE)

    def poll(self) -> Iterator[Update]:
        """Yield the parameters that have changed."""
        from composer.runtime.ros.parameter_values import plain_value

        found: dict[str, dict[str, Any]] = {}
        for sample in self._events.take(_MAX_EVENTS):
            event = sample.content
            for item in (*event.new_parameters, *event.changed_parameters):
                name = full_name(event.node, item.name)
                found[name] = parameter(name, plain_value(item.value))
            for item in event.deleted_parameters:
                name = full_name(event.node, item.name)
                found[name] = parameter(name, None)
        if found:
            yield Update(to_json(list(found.values())))

    def close(self) -> None:
        """Unsubscribe."""
        self._events.close()


def full_name(node: str, name: str) -> str:
    """Return the name of a parameter among those of all nodes."""
    return f"{node}.{name}"


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


def read_all(ros: RosGraphSide, deadline: Deadline, names: Iterable[str]) -> Found:
    """Return the parameters with these names, those of all nodes without any."""
    by_node: dict[str, list[str]] = {}
    for name in names:
        node, last = _split(name)
        by_node.setdefault(node, []).append(last)
    if not by_node:
        return _read_everything(ros, deadline)
    return _for_each(by_node, ros, deadline, _read)


def set_all(ros: RosGraphSide, deadline: Deadline, settings: Iterable[Setting]) -> Found:
    """Set parameters one by one, and return their values then."""
    by_node: dict[str, list[Setting]] = {}
    for setting in settings:
        by_node.setdefault(setting.node, []).append(setting)
    return _for_each(by_node, ros, deadline, _set)


def _read_everything(ros: RosGraphSide, deadline: Deadline) -> Found:
    from composer.client.snapshot import GraphObserver

    # Nodes that have just ended would be waited for.
    present = {name for name, _ in ros.session.graph.names("node")}
    nodes = {name: ends for name, ends in ros.observed.known().nodes.items() if name in present}
    with GraphObserver(ros.session) as observer:
        found = observer.parameters(nodes, deadline)
    parameters = [
        parameter(full_name(node, name), value)
        for node in sorted(found)
        for name, value in (found[node] or {}).items()
    ]
    silent = [node for node in sorted(found) if found[node] is None]
    problems = [f"no parameters of {', '.join(silent)}: no response"] if silent else []
    return Found(parameters, problems)


def _for_each(by_node: Mapping[str, Any], ros: RosGraphSide, deadline: Deadline, act: Any) -> Found:
    from composer.client.parameters import ParameterClient
    from composer.client.session import RosError

    found = Found([], [])
    for node, items in by_node.items():
        try:
            act(ParameterClient(ros.session, deadline, node), items, found)
        except RosError as error:
            found.problems.append(_text(error))
    return found


def _read(client: ParameterClient, names: list[str], found: Found) -> None:
    known = client.names()
    wanted = [name for name in names if name in known]
    values = client.values(wanted) if wanted else {}
    found.parameters.extend(
        parameter(full_name(client.node, name), values[name]) for name in wanted
    )
    found.problems.extend(
        f"{client.node} has no parameter '{name:.80}'" for name in names if name not in known
    )


def _set(client: ParameterClient, settings: list[Setting], found: Found) -> None:
    from composer.client.session import RosError

    for setting in settings:
        try:
            if setting.value is None:
                client.delete(setting.name)
            else:
                client.set({setting.name: setting.value})
        except RosError as error:
            found.problems.append(_text(error))
    known = client.names()
    names = dict.fromkeys(setting.name for setting in settings)
    values = client.values([name for name in names if name in known])
    found.parameters.extend(
        parameter(full_name(client.node, name), values.get(name)) for name in names
    )


def _text(error: Any) -> str:
    return f"{error} ({error.hint})" if error.hint else str(error)


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
