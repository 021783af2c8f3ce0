"""The descriptions of the parameters of many nodes at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import closing

from rcl_interfaces.srv import DescribeParameters

from composer.client.requests import ServiceCaller
from composer.client.session import Deadline, Session
from composer.language.tree import Plain
from composer.runtime.protocol.requests import ParameterDescription
from composer.runtime.ros.parameter_values import description

#: How long to wait for the responses of nodes; the parameters of later ones have no description.
_RESPONSE_S = 2.0
_SERVICE = "describe_parameters"
_TYPE = "rcl_interfaces/srv/DescribeParameters"


def parameter_settings(
    session: Session, deadline: Deadline, names: Mapping[str, Iterable[str]]
) -> dict[str, dict[str, dict[str, Plain]]]:
    """Return the declarations of parameters as in YAML, by node and parameter.

    ``names`` are the parameters of each node. Nodes without the service, or that do not respond,
    are left out.
    """
    known = {name for name, types in session.graph.services() if _TYPE in types}
    requests = {
        f"{node}/{_SERVICE}": (node, list(parameters))
        for node, parameters in names.items()
        if f"{node}/{_SERVICE}" in known
    }
    with closing(ServiceCaller(session)) as caller:
        responses = caller.call_all(
            DescribeParameters,
            {
                service: DescribeParameters.Request(names=listed)
                for service, (_, listed) in requests.items()
            },
            Deadline(min(_RESPONSE_S, deadline.left_s)),
        )
    found: dict[str, dict[str, dict[str, Plain]]] = {}
    for service, (node, listed) in requests.items():
        response = responses[service]
        if response is not None and len(response.descriptors) == len(listed):
            descriptions = map(description, listed, response.descriptors)
            found[node] = {item.name: settings_of(item) for item in descriptions}
    return found


def settings_of(item: ParameterDescription) -> dict[str, Plain]:
    """Return the declaration of a parameter as in YAML, without its value."""
    settings: dict[str, Plain] = {
        "minimum": item.minimum,
        "maximum": item.maximum,
        "step": item.step,
        "read_only": item.read_only or None,
        "description": item.description or None,
    }
    if "unknown" not in item.type and item.type != "not set":
        settings["type"] = item.type
    return {key: value for key, value in settings.items() if value is not None}
