"""Operations that call services, publish messages, set parameters, and describe interfaces."""

from __future__ import annotations

import time
from contextlib import closing
from typing import TYPE_CHECKING, Any

from composer.dashboard.channels.sending import read_outgoing
from composer.dashboard.context import Dashboard, Prepared
from composer.dashboard.protocol.messages import Values, json_safe

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.observing.ros_graph import RosGraph

_CHANGE_S = 5.0
_MAX_TIMEOUT_S = 120.0
#: How long to wait for known subscriptions to match a new publisher.
_MATCHED_WITHIN_S = 2.0
_MAX_ITEMS = 1000
_DESCRIBED_WITHIN_S = 5.0


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
    outgoing = read_outgoing(values)

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.session import Deadline as Limit

        outgoing.open(ros)
        try:
            limit = Limit(min(_MATCHED_WITHIN_S, deadline.left_s))
            expected = outgoing.expected()
            ros.session.wait_for(lambda: outgoing.subscriptions >= expected or None, limit)
            outgoing.publish()
            outgoing.wait_until_acknowledged()
            return {"subscriptions": outgoing.subscriptions}
        finally:
            outgoing.close()

    return run, _CHANGE_S


def set_parameter(values: Values, _: Dashboard) -> Prepared:
    """Set a parameter of a node."""
    node, name, value = values.text("node"), values.text("name"), values.any("value")

    def run(ros: RosGraph, deadline: Deadline) -> dict[str, Any]:
        from composer.client.parameters import ParameterClient

        with closing(ParameterClient(ros.session, deadline, node)) as client:
            return {"value": json_safe(client.set({name: value})[name])}

    return run, _CHANGE_S


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
