"""What a system's manager answers for the nodes that have given up services of their own.

One set of services stands for all nodes, so that their number does not grow with the system. The
types are the standard ones; a node is named inside of what is asked:

- ``change_state`` (lifecycle_msgs): the transition's label is ``<node> <transition>``, as in
  ``/planning/planner activate``. Where nodes are is told on the manager's topic ``state``.
- ``list_parameters``, ``get_parameters``, ``set_parameters`` ... (rcl_interfaces): parameters are
  called ``<node>.<parameter>``, as in ``/planning/planner.max_velocity``.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
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
from rclpy.node import Node

from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.loop import Reply, never_called
from composer.runtime.manager import parameter_answers
from composer.runtime.node.node import RunningNode
from composer.runtime.ros.manager_protocol import CHANGE_STATE, full_parameter_name


class ProxyServices:
    """The services. ``members`` returns the nodes, by their full names."""

    def __init__(
        self,
        node: Node,
        loop: EventLoop,
        members: Callable[[], Mapping[str, RunningNode]],
        tell_states: Callable[[], None],
    ) -> None:
        """Serve on ``loop`` with services of ``node``; ``tell_states`` after each transition."""
        self._node = node
        self._loop = loop
        self._members = members
        self._tell_states = tell_states
        self._serve(CHANGE_STATE, ChangeState, self._change_state)
        self._serve("list_parameters", ListParameters, self._list)
        self._serve("get_parameters", GetParameters, self._get)
        self._serve("get_parameter_types", GetParameterTypes, self._get_types)
        self._serve("describe_parameters", DescribeParameters, self._describe)
        self._serve("set_parameters", SetParameters, self._set)
        self._serve("set_parameters_atomically", SetParametersAtomically, self._set_atomically)

    def _serve(
        self, name: str, kind: Any, answer: Callable[[Any], Coroutine[Any, Any, Any]]
    ) -> None:
        async def reply_to(request: Any, reply: Reply) -> None:
            try:
                response = await answer(request)
            except BaseException:
                reply(kind.Response())
                raise
            reply(response)
            self._tell_states()

        def take(request: Any, reply: Reply) -> None:
            self._loop.run_task(reply_to(request, reply))

        service = self._node.create_service(kind, f"~/{name}", never_called)
        self._loop.add_service(service, take)

    async def _change_state(self, request: Any) -> Any:
        name, _, transition = request.transition.label.partition(" ")
        member = self._members().get(name)
        if member is None:
            return ChangeState.Response(success=False)
        result = await member.loop.run_task(member.change(transition))
        return ChangeState.Response(success=result.success)

    async def _list(self, request: Any) -> Any:
        """Answer for the nodes that are asked for as prefixes, or all that cannot themselves."""
        wanted = set(request.prefixes)
        found = ListParametersResult()
        for name, member in self._members().items():
            if name in wanted or not (wanted or member.model.introspection.parameters):
                names = await member.ask(parameter_answers.names)
                found.prefixes.append(name)
                found.names += [full_parameter_name(name, parameter) for parameter in names]
        return ListParameters.Response(result=found)

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

    async def _set_atomically(self, request: Any) -> Any:
        return SetParametersAtomically.Response(result=await self._assign(request.parameters))

    async def _value(self, name: str) -> ParameterValue:
        member, parameter = self._find(name)
        if member is None:
            return ParameterValue()
        return await member.ask(lambda node: parameter_answers.value(node, parameter))

    async def _description(self, name: str) -> ParameterDescriptor:
        member, parameter = self._find(name)
        if member is None:
            return ParameterDescriptor(name=name)
        found = copy(await member.ask(lambda node: parameter_answers.description(node, parameter)))
        found.name = name
        return found

    async def _assign(self, changes: list[ParameterMessage]) -> SetParametersResult:
        owners = {change.name.partition(".")[0] for change in changes}
        members = [self._members().get(owner) for owner in owners]
        if len(members) != 1 or members[0] is None:
            names = ", ".join(sorted(owners))
            return SetParametersResult(
                successful=False, reason=f"they must be of one node of this system, not of {names}"
            )
        own = [
            ParameterMessage(name=change.name.partition(".")[2], value=change.value)
            for change in changes
        ]
        return await members[0].ask(lambda node: parameter_answers.assign(node, own))

    def _find(self, name: str) -> tuple[RunningNode | None, str]:
        owner, _, parameter = name.partition(".")
        return self._members().get(owner), parameter
