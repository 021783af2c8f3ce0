"""Services of the manager node for nodes that have none of their own.

One set of services serves all nodes, so that their number does not grow with the system. They have
the standard types, and requests contain the name of the node:

- ``change_state`` (lifecycle_msgs): the label of the transition is ``<node> <transition>``, as in
  ``/planning/planner activate``. The manager publishes the states of the nodes on ``state``.
- ``list_parameters``, ``get_parameters``, ``set_parameters`` ... (rcl_interfaces): parameter names
  are ``<node>.<parameter>``, as in ``/planning/planner.max_velocity``.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable, Mapping
from copy import copy
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter

from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.loop import Reply, unused_callback
from composer.runtime.node.node import RunningNode
from composer.runtime.ros.manager_protocol import CHANGE_STATE, full_parameter_name


class ProxyServices:
    """The services for the nodes that ``nodes()`` returns by their full names."""

    def __init__(
        self,
        node: Node,
        loop: EventLoop,
        nodes: Callable[[], Mapping[str, RunningNode]],
        publish_states: Callable[[], None],
    ) -> None:
        """Add the services to ``node``; call ``publish_states`` after each response."""
        self._node = node
        self._loop = loop
        self._nodes = nodes
        self._publish_states = publish_states
        self._add_service(CHANGE_STATE, ChangeState, self._change_state)
        self._add_service("list_parameters", ListParameters, self._list)
        self._add_service("get_parameters", GetParameters, self._get)
        self._add_service("get_parameter_types", GetParameterTypes, self._get_types)
        self._add_service("describe_parameters", DescribeParameters, self._describe)
        self._add_service("set_parameters", SetParameters, self._set)
        self._add_service("set_parameters_atomically", SetParametersAtomically, self._set_all)

    def _add_service(
        self, name: str, kind: Any, answer: Callable[[Any], Coroutine[Any, Any, Any]]
    ) -> None:
        async def reply_to(request: Any, reply: Reply) -> None:
            try:
                response = await answer(request)
            except BaseException:
                reply(kind.Response())
                raise
            reply(response)
            self._publish_states()

        def on_request(request: Any, reply: Reply) -> None:
            self._loop.run_task(reply_to(request, reply))

        service = self._node.create_service(kind, f"~/{name}", unused_callback)
        self._loop.add_service(service, on_request)

    async def _change_state(self, request: Any) -> Any:
        name, _, transition = request.transition.label.partition(" ")
        node = self._nodes().get(name)
        if node is None:
            return ChangeState.Response(success=False)
        result = await node.loop.run_task(node.lifecycle.change(transition))
        return ChangeState.Response(success=result.success)

    async def _list(self, request: Any) -> Any:
        """Return the parameters of the nodes in ``prefixes``, by default of all proxied nodes."""
        prefixes = set(request.prefixes)
        result = ListParametersResult()
        for name, node in self._nodes().items():
            if name in prefixes or not (prefixes or node.model.introspection.parameters):
                names = await node.query(_parameter_names)
                result.prefixes.append(name)
                result.names += [full_parameter_name(name, parameter) for parameter in names]
        return ListParameters.Response(result=result)

    async def _get(self, request: Any) -> Any:
        return GetParameters.Response(values=[await self._value(name) for name in request.names])

    async def _get_types(self, request: Any) -> Any:
        values = [await self._value(name) for name in request.names]
        return GetParameterTypes.Response(types=[value.type for value in values])

    async def _describe(self, request: Any) -> Any:
        return DescribeParameters.Response(
            descriptors=[await self._description(name) for name in request.names]
        )

    async def _set(self, request: Any) -> Any:
        results = [await self._assign([change]) for change in request.parameters]
        return SetParameters.Response(results=results)

    async def _set_all(self, request: Any) -> Any:
        return SetParametersAtomically.Response(result=await self._assign(request.parameters))

    async def _value(self, name: str) -> ParameterValue:
        node, parameter = self._find(name)
        if node is None:
            return ParameterValue()
        return await node.query(lambda ros_node: _parameter_value(ros_node, parameter))

    async def _description(self, name: str) -> ParameterDescriptor:
        node, parameter = self._find(name)
        if node is None:
            return ParameterDescriptor(name=name)
        descriptor = await node.query(lambda ros_node: _descriptor(ros_node, parameter))
        descriptor = copy(descriptor)
        descriptor.name = name
        return descriptor

    async def _assign(self, changes: list[ParameterMessage]) -> SetParametersResult:
        names = {change.name.partition(".")[0] for change in changes}
        nodes = [self._nodes().get(name) for name in names]
        if len(nodes) != 1 or nodes[0] is None:
            shown = ", ".join(sorted(names))
            return SetParametersResult(
                successful=False, reason=f"expected parameters of one node, not of {shown}"
            )
        own = [
            ParameterMessage(name=change.name.partition(".")[2], value=change.value)
            for change in changes
        ]
        return await nodes[0].query(lambda ros_node: _set_parameters(ros_node, own))

    def _find(self, name: str) -> tuple[RunningNode | None, str]:
        node, _, parameter = name.partition(".")
        return self._nodes().get(node), parameter


# rclpy answers parameter requests only in services that it creates itself. These functions return
# the same results, for requests of other services.


def _parameter_names(node: Node) -> list[str]:
    return list(node.list_parameters([], 0).names)


def _parameter_value(node: Node, name: str) -> ParameterValue:
    return node.get_parameter_or(name, Parameter(name)).get_parameter_value()


def _descriptor(node: Node, name: str) -> ParameterDescriptor:
    try:
        return node.describe_parameter(name)
    except ParameterNotDeclaredException:
        return ParameterDescriptor(name=name)


def _set_parameters(node: Node, changes: Iterable[ParameterMessage]) -> SetParametersResult:
    """Set all parameters or none."""
    try:
        return node.set_parameters_atomically(list(map(Parameter.from_parameter_msg, changes)))
    except ParameterNotDeclaredException as error:
        return SetParametersResult(successful=False, reason=str(error))
