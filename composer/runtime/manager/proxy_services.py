"""Services of the manager node for nodes that have none of their own.

One set of services serves all nodes, so that their number does not grow with the system. They have
the standard types, and requests contain the name of the node:

- ``change_state`` (lifecycle_msgs): the label of the transition is ``<node> <transition>``, as in
  ``/planning/planner activate``. The manager publishes the states of the nodes on ``state``.
- ``list_parameters``, ``get_parameters``, ``set_parameters`` ... (rcl_interfaces): parameter names
  are ``<node>.<parameter>``, as in ``/planning/planner.max_velocity``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
from rclpy.node import Node

from composer.runtime.executors.loop import Loop
from composer.runtime.executors.sources import Reply, unused_callback
from composer.runtime.node.managed_node import InProcessNode, ManagedNode
from composer.runtime.node.parameter_services import (
    NodeParameterStore,
    UnknownParameterError,
    descriptor_of,
    set_parameters,
    value_of,
)
from composer.runtime.protocol.requests import CHANGE_STATE, full_parameter_name
from composer.runtime.ros.limited_requests import TooLarge, limited

#: Returns the nodes of the system by their full names.
Nodes = Callable[[], Mapping[str, ManagedNode]]


class ProxyLifecycleService:
    """The service ``change_state`` for the nodes that ``nodes()`` returns."""

    def __init__(
        self, node: Node, loop: Loop, nodes: Nodes, publish_states: Callable[[], None]
    ) -> None:
        """Add the service to ``node``; call ``publish_states`` after each response, on the loop."""
        self._loop = loop
        self._nodes = nodes
        self._publish_states = publish_states
        service = node.create_service(limited(ChangeState), f"~/{CHANGE_STATE}", unused_callback)
        loop.add_service(service, self._on_request)

    def _on_request(self, request: Any, reply: Reply) -> None:
        if isinstance(request, TooLarge):
            reply(ChangeState.Response(success=False))
            return
        self._loop.run_task(self._change_state(request, reply))

    async def _change_state(self, request: Any, reply: Reply) -> None:
        name, _, transition = request.transition.label.partition(" ")
        node = self._nodes().get(name)
        success = False
        try:
            if node is not None:
                result = await node.loop.run_task(node.lifecycle.change(transition))
                success = result.success
        finally:
            reply(ChangeState.Response(success=success))
        self._publish_states()


class ProxyParameterStore(NodeParameterStore):
    """The parameters of the manager, and those of the nodes that ``nodes()`` returns.

    Unknown parameters of nodes are not set.
    """

    def __init__(self, manager: Node, nodes: Nodes) -> None:
        super().__init__(manager)
        self.manager = manager.get_fully_qualified_name()
        self._nodes = nodes

    async def list_names(self, prefixes: list[str], depth: int) -> ListParametersResult:
        """Return the parameters of the nodes in ``prefixes``, by default of all proxied nodes."""
        requested = set(prefixes)
        result = await super().list_names(prefixes, depth)
        for name, node in self._nodes().items():
            if not isinstance(node, InProcessNode):
                continue  # it has parameter services of its own
            if name in requested or not (requested or node.model.introspection.parameters):
                names = await self.names_of(name)
                result.prefixes.append(name)
                result.names += [full_parameter_name(name, parameter) for parameter in names]
        return result

    def nodes(self) -> list[str]:
        """Return the full names of the manager and the nodes whose parameters are known."""
        return [self.manager, *filter(self.has, self._nodes())]

    def has(self, name: str) -> bool:
        """Return whether these are the parameters of a node, by its full name."""
        return name == self.manager or self._local(name) is not None

    async def names_of(self, name: str) -> list[str]:
        """Return the names of the parameters of a node, none if it is not in this process."""
        if name == self.manager:
            return list(self._node.list_parameters([], 0).names)
        node = self._local(name)
        if node is None:
            return []
        return await node.query(lambda ros_node: list(ros_node.list_parameters([], 0).names))

    async def value(self, name: str) -> ParameterValue:
        """Return the value of a parameter."""
        if not _is_of_node(name):
            return await super().value(name)
        node, parameter = self._find(name)
        if node is None:
            return ParameterValue()
        try:
            return await node.query(lambda ros_node: value_of(ros_node, parameter))
        except UnknownParameterError:
            return ParameterValue()

    async def type_of(self, name: str) -> int:
        """Return the type of a parameter."""
        if not _is_of_node(name):
            return await super().type_of(name)
        return int((await self.value(name)).type)

    async def descriptor(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter."""
        if not _is_of_node(name):
            return await super().descriptor(name)
        node, parameter = self._find(name)
        try:
            if node is None:
                return ParameterDescriptor(name=name)
            descriptor = copy(await node.query(lambda ros_node: descriptor_of(ros_node, parameter)))
        except UnknownParameterError:
            return ParameterDescriptor(name=name)
        descriptor.name = name
        return descriptor

    async def set(self, changes: list[ParameterMessage]) -> SetParametersResult:
        """Set all parameters or none; they must belong to one node."""
        if not any(_is_of_node(change.name) for change in changes):
            return await super().set(changes)
        names = {change.name.partition(".")[0] for change in changes}
        nodes = [self._local(name) for name in names]
        if len(nodes) != 1 or nodes[0] is None:
            shown = ", ".join(sorted(names))
            return SetParametersResult(
                successful=False, reason=f"expected parameters of one node, not of {shown:.500}"
            )
        own = [
            ParameterMessage(name=change.name.partition(".")[2], value=change.value)
            for change in changes
        ]
        return await nodes[0].query(lambda ros_node: set_parameters(ros_node, own))

    def _find(self, name: str) -> tuple[InProcessNode | None, str]:
        name, _, parameter = name.partition(".")
        return self._local(name), parameter

    def _local(self, name: str) -> InProcessNode | None:
        node = self._nodes().get(name)
        return node if isinstance(node, InProcessNode) else None


def _is_of_node(name: str) -> bool:
    """Return whether ``name`` begins with the full name of a node."""
    return name.startswith("/")
