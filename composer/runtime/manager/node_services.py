"""Answers requests to lifecycle and parameter services that nodes leave to the manager.

With ``introspection``, the nodes of a large system create none of these services. A client sends
what it would send to them to the service ``request`` of the manager, which has it answered on the
loop of the node.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from lifecycle_msgs.msg import State, Transition, TransitionDescription
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState

from composer.runtime.node.managed_node import InProcessNode, ManagedNode
from composer.runtime.node.parameter_services import PARAMETER_SERVICES
from composer.runtime.protocol.requests import CallNodes, NodeCall, NodeResponses
from composer.runtime.ros.messages import MessageError, convert_message, to_plain

#: Returns the nodes of the system by their full names.
Nodes = Callable[[], Mapping[str, ManagedNode]]

_LIFECYCLE_SERVICES: Mapping[str, Any] = {
    "get_state": GetState,
    "get_available_transitions": GetAvailableTransitions,
    "change_state": ChangeState,
}
#: The state in which a transition runs, by its label.
_DURING = {
    "configure": "configuring",
    "cleanup": "cleaningup",
    "activate": "activating",
    "deactivate": "deactivating",
    "shutdown": "shuttingdown",
}


async def answer_calls(request: CallNodes, nodes: Mapping[str, ManagedNode]) -> NodeResponses:
    """Return the responses of the services of ``nodes``, which are by their full names."""
    return NodeResponses(tuple([await _response(call, nodes) for call in request.calls]))


async def _response(call: NodeCall, nodes: Mapping[str, ManagedNode]) -> Mapping[str, Any] | None:
    name, _, service = call.service.rpartition("/")
    node = nodes.get(name)
    kind = _LIFECYCLE_SERVICES.get(service) or PARAMETER_SERVICES.get(service)
    if node is None or kind is None:
        return None
    try:
        request = convert_message(call.request, kind.Request, f"the request to '{call.service}'")
    except MessageError:
        return None
    if service in _LIFECYCLE_SERVICES:
        response = await _lifecycle_response(node, request)
    elif isinstance(node, InProcessNode):
        services = node.parameter_services
        response = await node.loop.run_task(services.answer(service, request, kind.Response()))
    else:
        return None
    plain: Mapping[str, Any] = to_plain(response)
    return plain


async def _lifecycle_response(node: ManagedNode, request: Any) -> Any:
    if isinstance(request, GetState.Request):
        return GetState.Response(current_state=State(label=node.state))
    if isinstance(request, ChangeState.Request):
        change = node.lifecycle.change(request.transition.label)
        return ChangeState.Response(success=(await node.loop.run_task(change)).success)
    transitions = [
        TransitionDescription(
            transition=Transition(id=number, label=label),
            start_state=State(label=node.state),
            goal_state=State(label=_DURING[label]),
        )
        for label, number in node.lifecycle.available.items()
    ]
    return GetAvailableTransitions.Response(available_transitions=transitions)
