"""A node that is implemented by a component: a container loads it into its process."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, TypeAlias

from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter as RosParameter

from composer.model import SEVERITIES, Component, LogLevel, Node
from composer.model.interface_packages import COMPOSITION, how_to_build
from composer.model.lifecycle import ACTIVE, FINALIZED, UNCONFIGURED
from composer.runtime.children.command_line import remappings
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import wait_for
from composer.runtime.node.parameters import parameter_message
from composer.runtime.outside_nodes.outside_node import (
    PERIOD_S,
    ObservedNode,
    OutsideContext,
    TransitionRefused,
)
from composer.runtime.outside_nodes.remote_node import NotAnswered, RemoteServices
from composer.runtime.outside_nodes.started_node import Ended, StartedNode
from composer.runtime.ros.messages import MessageError, interface_class

#: How long an unloaded node may stay in the ROS graph.
_GONE_WITHIN_S = 1.0
#: What is kept of a text of a container, in characters: nodes, reports and logs repeat it.
_LONGEST_TEXT = 1000
#: Messages of composition_interfaces, which need not be installed.
_Message: TypeAlias = Any


def _service(name: str) -> Any:
    return interface_class(f"{COMPOSITION}/srv/{name}")


class ComponentNode(StartedNode["LoadedComponent"]):
    """The :class:`.ManagedNode` of a component. Its container is another node of the process."""

    _when_silent = "it was unloaded"

    def __init__(self, model: Node, component: Component, context: OutsideContext) -> None:
        super().__init__(model, component, context)
        self._component = component
        self._nodes = context.nodes
        self._timer = self.loop.call_every(PERIOD_S, self._check)

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take: loading and unloading included."""
        return 2 * self._timeout_s + self._component.ready_timeout_s + _GONE_WITHIN_S

    @property
    def figures(self) -> Mapping[str, Any]:
        """The process of its container; its rates and counters are not known."""
        return {} if self._started is None else self._container.figures

    def destroy(self) -> None:
        """Forget the component: the container keeps it."""
        self._timer.cancel()
        self._close_remote()
        if self._started is not None:
            self._started.close()
            self._started = None

    @property
    def _container(self) -> ObservedNode:
        name = self.model.container
        node = None if name is None else self._nodes.get(name.value)
        if not isinstance(node, ObservedNode):
            raise TransitionRefused("it has no container", UNCONFIGURED)
        return node

    def _find(self) -> None:
        try:
            _service("LoadNode")
        except MessageError as error:
            text = f"{error}; build it: {how_to_build(COMPOSITION, None)}"
            raise TransitionRefused(text, UNCONFIGURED) from error

    async def _start(self, state: str) -> LoadedComponent:
        """Load the component."""
        await self._end()
        container = self._container
        if container.state != ACTIVE:
            self._is_lost = True
            text = f"its container {container.full_name} is {container.state}"
            raise TransitionRefused(text, state)
        self.presence.earlier = container.presence.earlier
        run = LoadedComponent(self._manager, self.loop, container, self._on_container_end)
        end_s = self.loop.clock.monotonic() + self._component.ready_timeout_s
        try:
            await self._while_it_runs(run, self._load(run, end_s))
        except (Ended, NotAnswered, LoadFailed) as error:
            run.close()
            limit = f" within {self._component.ready_timeout_s:g} s"
            text = (
                self._how_ended(run) or f"{error}{limit if isinstance(error, NotAnswered) else ''}"
            )
            raise TransitionRefused(text, state) from error
        self._is_lost = False
        self._watch(run)
        return run

    async def _load(self, run: LoadedComponent, end_s: float) -> None:
        """Load the component once the container is there. Raises LoadFailed, NotAnswered."""
        if not await self._until_ready(run.is_ready, end_s):
            raise NotAnswered(f"{run.container.full_name} has no service {run.load_service}")
        async with run.alone(end_s):
            for unique_id in await run.ids(self.full_name, end_s):
                self._listener.write_log(
                    LogLevel.WARN, self._logger, "it was loaded already, and is loaded again"
                )
                await run.unload(unique_id, end_s)
            name = await run.load(_load_request(self.model, self._component), self.full_name, end_s)
            if name != self.full_name:
                await run.unload(run.unique_id, end_s)
                raise LoadFailed(f"{run.container.full_name} has given it the name {name}")

    async def _unload(self, run: LoadedComponent, end_s: float) -> None:
        """Unload the component. Raises NotAnswered."""
        async with run.alone(end_s):
            await run.unload(run.unique_id, end_s)

    async def _end(self) -> None:
        """Unload the component."""
        run = self._started
        self._close_remote()
        if run is None:
            return
        self._started = None  # its end is expected
        try:
            if not run.ended.done() and run.container.state == ACTIVE:
                end_s = self.loop.clock.monotonic() + self._limit_s(self._timeout_s)
                await self._while_it_runs(run, self._unload(run, end_s))
                if self._run_state.end_s is None:  # it may be loaded again
                    end_s = self.loop.clock.monotonic() + _GONE_WITHIN_S
                    await self._until(lambda: not self.presence.has_node(), end_s)
        except NotAnswered as error:
            raise TransitionRefused(f"cannot be unloaded: {error}", UNCONFIGURED) from error
        except Ended:
            pass  # the container has ended, and the component with it
        finally:
            run.close()

    def _how_ended(self, run: LoadedComponent) -> str:
        return run.ended.result() if run.ended.done() else ""

    def _on_container_end(self, run: LoadedComponent, reason: str) -> None:
        self._is_lost = True
        run.ended.set_result(f"its container {run.container.full_name} {reason}")

    def _check(self) -> None:
        """Notice that the component has gone, and that its container returns."""
        if self._lock.is_held or self.state == FINALIZED:
            return
        run = self._started
        if run is None:
            if self._is_lost and self._container.state == ACTIVE:
                self._is_lost = False
                self._listener.on_returned()
        elif run.container.state != ACTIVE:
            self._on_container_end(run, f"is {run.container.state}")
        elif run.is_restarted():
            self._on_container_end(run, "was started again")
        elif not self.presence.has_node():
            run.ended.set_result("it has disappeared from the ROS graph: something has unloaded it")


class LoadFailed(Exception):
    """A container has refused to load a component; the text says why."""


class LoadedComponent(RemoteServices):
    """A component in its container, and the clients of the container. Use it on ``loop``.

    ``ended`` has the reason once the component has ended by itself.
    """

    def __init__(
        self,
        ros: RosNode,
        loop: Loop,
        container: ObservedNode,
        on_container_end: Callable[[LoadedComponent, str], None],
    ) -> None:
        super().__init__(ros, loop, container.full_name)
        self.container = container
        self.unique_id = 0
        self.ended: Future[str] = Future()
        self.load_service = f"{container.full_name}/_container/load_node"
        self._participants: frozenset[bytes] = frozenset()
        self._loading = self._client(_service("LoadNode"), "_container/load_node")
        self._unloading = self._client(_service("UnloadNode"), "_container/unload_node")
        self._listing = self._client(_service("ListNodes"), "_container/list_nodes")
        self._follow = partial(on_container_end, self, "has ended")
        container.followers.add(self._follow)

    def close(self) -> None:
        """Destroy the clients."""
        self.container.followers.discard(self._follow)
        super().close()

    @asynccontextmanager
    async def alone(self, end_s: float) -> AsyncIterator[None]:
        """Wait until the container does nothing for another component. Raises NotAnswered."""
        while (current := self.container.loading.try_acquire()) is not None:
            left_s = end_s - self._clock.monotonic()
            if left_s <= 0.0:
                raise NotAnswered(f"{self.container.full_name} is busy with another component")
            await wait_for(self._loop, current, left_s)
        try:
            yield
        finally:
            self.container.loading.release()

    def is_ready(self) -> bool:
        """Return whether the container has its services."""
        are_ready = all(client.service_is_ready() for client in self._clients)
        return are_ready and bool(self._servers())

    def is_restarted(self) -> bool:
        """Return whether another process than the one that has loaded it is the container now."""
        return not self._servers() <= self._participants

    async def ids(self, full_name: str, end_s: float) -> list[int]:
        """Return the ids of loaded nodes with a name. Raises NotAnswered."""
        found = await self._ask(self._listing, _service("ListNodes").Request(), end_s)
        named = zip(found.full_node_names, found.unique_ids, strict=False)
        return [int(unique_id) for name, unique_id in named if name == full_name]

    async def load(self, request: _Message, full_name: str, end_s: float) -> str:
        """Load the component, and return its full name. Raises LoadFailed, NotAnswered.

        The request is sent once: a second one would load a second node. If there is no response,
        the container is asked for what it has loaded.
        """
        self._participants = self._servers()
        future = self._loading.call_async(request)
        try:
            while True:
                response = await self._response(future, end_s)
                if response is None:
                    loaded = await self.ids(full_name, end_s)
                    if loaded:
                        self.unique_id = loaded[0]
                        return full_name
                elif response.success:
                    self.unique_id = int(response.unique_id)
                    return str(response.full_node_name)[:_LONGEST_TEXT]
                else:
                    reason = response.error_message[:_LONGEST_TEXT].strip() or "it does not say why"
                    raise LoadFailed(f"{self.container.full_name} cannot load it: {reason}")
        finally:
            self._loading.remove_pending_request(future)

    def _servers(self) -> frozenset[bytes]:
        return self.container.presence.servers(self.load_service)

    async def unload(self, unique_id: int, end_s: float) -> None:
        """Unload a node, which need not be loaded. Raises NotAnswered."""
        request = _service("UnloadNode").Request(unique_id=unique_id)
        await self._ask(self._unloading, request, end_s)


def _load_request(node: Node, component: Component) -> _Message:
    parameters = (*node.parameters, *node.undeclared_parameters)
    return _service("LoadNode").Request(
        package_name="" if component.package is None else component.package.value,
        plugin_name="" if component.plugin is None else component.plugin.value,
        node_name=node.ros_name.value,
        node_namespace=node.namespace.value,
        log_level=0 if node.log_level is None else SEVERITIES[node.log_level.value],
        remap_rules=list(remappings(node)),
        parameters=[
            parameter_message(parameter)
            for parameter in parameters
            if parameter.value is not None and parameter.value.value != []
        ],
        extra_arguments=[
            RosParameter(name.value, value=value).to_parameter_msg()
            for name, value in component.extra_arguments
        ],
    )
