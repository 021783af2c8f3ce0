"""What a browser can request: each operation reads its request and returns what a thread runs.

To add an operation, add a function, and its line in ``OPERATIONS``.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import closing
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.channels.nodes import COMMANDS
from composer.dashboard.channels.sending import Outgoing
from composer.dashboard.channels.topics import shown_qos
from composer.dashboard.context import Dashboard, Operation, Prepared, required
from composer.dashboard.protocol.messages import RequestError, Values, from_ros, json_safe
from composer.dashboard.recordings import RECORDINGS
from composer.model.lifecycle import TRANSITIONS

if TYPE_CHECKING:
    from composer.client.lifecycle import NodeOutcome
    from composer.client.session import Deadline
    from composer.dashboard.observing.ros_graph import RosGraph

_READ_S = 5.0
_CHANGE_S = 20.0
#: As long as the transitions of a node may take by default, with a margin.
_RESTART_S = 30.0
_SENT_WITHIN_S = 5.0
_MAX_TIMEOUT_S = 120.0
#: How long to wait for known subscriptions to match a new publisher.
_MATCHED_WITHIN_S = 2.0
_MAX_ITEMS = 1000
_DESCRIBED_WITHIN_S = 5.0


def node(values: Values, dashboard: Dashboard) -> Prepared:
    """Return everything that is known about a node."""
    name = values.text("node")
    declared = dashboard.declared

    def run(ros: RosGraph, _: Deadline) -> dict[str, Any]:
        topology = ros.known()
        facts = None if declared is None else declared.facts(name)
        if name not in topology.nodes and facts is None:
            raise RequestError("not_found", f"there is no node '{name:.200}'")
        return {
            "name": name,
            "count": topology.counts.get(name, 0),
            "endpoints": [
                {
                    "kind": end.kind.value,
                    "name": end.name,
                    "type": end.type,
                    "qos": shown_qos(end),
                    "for_tools": end.is_for_tools,
                }
                for end in topology.nodes.get(name, ())
            ],
            "declared": json_safe(facts),
            "source": None if declared is None else declared.source(name),
        }

    return run, _READ_S


def plan(_: Values, dashboard: Dashboard) -> Prepared:
    """Return the steps of the bring-up with their causes."""
    declared = required(dashboard.declared, "the plan")

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.plan import bring_up

        del ros, deadline
        steps = bring_up(declared.system, declared.autostart).steps
        return {
            "system": declared.system.name.value,
            "steps": [
                {
                    "number": step.number,
                    "node": step.full_name,
                    "transition": step.transition,
                    "cause": step.cause,
                    "after": list(step.after),
                    "declared_at": declared.declared_at(step.full_name),
                }
                for step in steps
            ],
        }

    return run, _READ_S


def drift(_: Values, dashboard: Dashboard) -> Prepared:
    """Return the differences between the declared system and the ROS graph."""
    declared = required(dashboard.declared, "the comparison")

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.snapshot import GraphObserver
        from composer.plan.drift import compare

        with GraphObserver(ros.session) as observer:
            found = compare(
                declared.system, observer.snapshot(deadline), autostart=declared.autostart
            )
        return {
            "system": declared.system.name.value,
            "differences": [item.plain() for item in found],
        }

    return run, _CHANGE_S


def transition(values: Values, _: Dashboard) -> Prepared:
    """Request a transition of a node, on request together with its dependents."""
    name, label = values.text("node"), values.choice("transition", tuple(TRANSITIONS))
    dependents = values.flag("dependents")

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.lifecycle import LifecycleBatch, LifecycleClient, LifecycleRequest

        with closing(LifecycleClient(ros.session, deadline)) as client:
            batch = LifecycleBatch(client, [name], LifecycleRequest(label, None))
            return {"outcomes": _completed(ros, batch.run(dependents=dependents))}

    return run, _CHANGE_S


def restart(values: Values, _: Dashboard) -> Prepared:
    """Restart a node: by the manager of its system, or else by its transitions."""
    name = values.text("node")

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.lifecycle import LifecycleBatch, LifecycleClient, LifecycleRequest

        message = _restart_by_manager(ros, deadline, name)
        if message is not None:
            return {"outcomes": [], "message": message}
        outcomes: list[dict[str, Any]] = []
        for state in ("unconfigured", "active"):
            # Each with new reports: which nodes depend on this one is decided by their states.
            with closing(LifecycleClient(ros.session, deadline)) as client:
                batch = LifecycleBatch(client, [name], LifecycleRequest(None, state))
                outcomes += _completed(ros, batch.run(dependents=True))
        return {"outcomes": outcomes, "message": ""}

    return run, _RESTART_S


def _restart_by_manager(ros: RosGraph, deadline: Deadline, name: str) -> str | None:
    """Restart a node of a system; return the message of the manager, None if it has no manager."""
    from composer.client.graph_names import NotFoundError
    from composer.client.systems.managers import Systems
    from composer.client.systems.process_list import find_managed_nodes

    with closing(Systems(ros.session, deadline)) as systems:
        try:
            ((system, nodes),) = find_managed_nodes(ros.session, deadline, systems, [name]).items()
        except NotFoundError:
            return None
        success, message = systems.restart(system, nodes)
    if not success:
        raise RequestError("rejected", message)
    return message


def command(values: Values, _: Dashboard) -> Prepared:
    """Send a command to the manager of a system."""
    system, name = values.text("system"), values.choice("command", COMMANDS)

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.systems.managers import Systems

        with closing(Systems(ros.session, deadline)) as systems:
            full_name = systems.find(system)
            if name == "shutdown":
                return {"message": systems.shut_down(full_name)}
            success, message = systems.command(full_name, name)
        if not success:
            raise RequestError("rejected", f"{full_name}: {message}")
        return {"message": message}

    return run, _CHANGE_S


def _completed(ros: RosGraph, outcomes: Iterable[NodeOutcome]) -> list[dict[str, Any]]:
    """Return all changes. Raises RequestError for the first that failed, after the others."""
    from composer.client.session import RosError

    found = list(outcomes)
    changes = [outcome for outcome in found if not isinstance(outcome, RosError)]
    ros.learn_states({change.node: change.after for change in changes})
    for outcome in found:
        if isinstance(outcome, RosError):
            raise from_ros(outcome)
    return [asdict(change) for change in changes]


def call(values: Values, _: Dashboard) -> Prepared:
    """Call a service."""
    name, type_name = values.text("service"), values.text("type")
    request = values.mapping("request")
    timeout_s = values.number("timeout_s", 5.0, 0.1, _MAX_TIMEOUT_S)

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.calls import ServiceRequest, call_service
        from composer.client.graph_names import full_name
        from composer.client.messages.values import to_short_plain

        service = full_name("service", name)
        content = ros.forms.from_json(request, type_name, "request")
        started_s = time.monotonic()
        responses = call_service(ros.session, deadline, ServiceRequest(service, type_name, content))
        response = next(responses)
        took_s = time.monotonic() - started_s
        return {"response": json_safe(to_short_plain(response, _MAX_ITEMS)), "took_s": took_s}

    return run, timeout_s


def publish(values: Values, _: Dashboard) -> Prepared:
    """Publish one message, and wait until reliable subscriptions have it."""
    outgoing = Outgoing(values)

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        with closing(outgoing.open(ros)) as publisher:
            limit = deadline.at_most(_MATCHED_WITHIN_S)
            expected = outgoing.expected()
            ros.session.wait_for(lambda: publisher.subscriptions >= expected, limit)
            outgoing.publish()
            publisher.wait_until_acknowledged()
            return {"subscriptions": publisher.subscriptions}

    return run, _SENT_WITHIN_S


def set_parameter(values: Values, _: Dashboard) -> Prepared:
    """Set a parameter of a node."""
    node, name, value = values.text("node"), values.text("name"), values.any("value")

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.parameters import ParameterClient

        with closing(ParameterClient(ros.session, deadline, node)) as client:
            return {"value": json_safe(client.set({name: value})[name])}

    return run, _SENT_WITHIN_S


def form(values: Values, _: Dashboard) -> Prepared:
    """Return the fields of each part of a type."""
    type_name = values.text("type")

    def run(ros: RosGraph, _: Deadline) -> dict[str, Any]:
        return {"type": type_name, "parts": ros.forms.form(type_name)}

    return run, _DESCRIBED_WITHIN_S


def fields(values: Values, _: Dashboard) -> Prepared:
    """Return the paths of the fields of a message that are numbers."""
    type_name = values.text("type")

    def run(ros: RosGraph, _: Deadline) -> dict[str, Any]:
        return {"numeric": ros.forms.numeric_paths(type_name)}

    return run, _DESCRIBED_WITHIN_S


def record(values: Values, _: Dashboard) -> Prepared:
    """Begin or end to record topics of the ROS graph."""
    is_on, topics = values.flag("on"), values.texts("topics", _MAX_ITEMS)

    def run(ros: RosGraph, _: Deadline) -> dict[str, Any]:
        del ros
        return {"message": RECORDINGS.record(topics) if is_on else RECORDINGS.stop("record")}

    return run, _CHANGE_S


def replay(values: Values, _: Dashboard) -> Prepared:
    """Begin to publish a bag, or end it."""
    is_on, bag = values.flag("on"), values.text("bag", "")

    def run(ros: RosGraph, _: Deadline) -> dict[str, Any]:
        del ros
        return {"message": RECORDINGS.replay(bag) if is_on else RECORDINGS.stop("replay")}

    return run, _CHANGE_S


OPERATIONS: dict[str, Operation] = {
    "node": Operation(node),
    "plan": Operation(plan),
    "drift": Operation(drift),
    "transition": Operation(transition, changes=True),
    "restart": Operation(restart, changes=True),
    "command": Operation(command, changes=True),
    "form": Operation(form),
    "fields": Operation(fields),
    "call": Operation(call, changes=True),
    "publish": Operation(publish, changes=True),
    "set_parameter": Operation(set_parameter, changes=True),
    "record": Operation(record, changes=True),
    "replay": Operation(replay, changes=True),
}
