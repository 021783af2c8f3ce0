"""Creates the nodes of a system, and the loops that run them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from functools import partial

from composer.base.source import Located
from composer.behavior import CallCancelled
from composer.model import (
    DEFAULT_EXECUTOR,
    Executor,
    ExecutorKind,
    LogLevel,
    Node,
    System,
)
from composer.model.names import join
from composer.runtime.callbacks.log import Write, set_level
from composer.runtime.callbacks.observers import Chains, MessageSnapshots
from composer.runtime.children.child_processes import ChildProcesses
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tracebacks import exception_log
from composer.runtime.host_options import HostOptions
from composer.runtime.hosting.hosted_node import HostedNode, NodeOfBehavior
from composer.runtime.intra_process.router import LocalRouter, shared_channels
from composer.runtime.members.node import MemberNode
from composer.runtime.members.other_processes import OtherProcesses
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.managed_node import (
    ManagedNode,
    NodeListener,
    RunState,
)
from composer.runtime.node.node import RunningNode
from composer.runtime.node.options import NodeOptions, ProcessContext
from composer.runtime.outside_nodes.component_node import ComponentNode
from composer.runtime.outside_nodes.outside_node import ExternalNode, OutsideContext
from composer.runtime.outside_nodes.started_node import ExecutableNode

#: The loop on which all nodes outside the process are driven.
_OUTSIDE = "nodes outside the process"


class NodeFactory:
    """What the nodes of one system have in common. A loop is created with its first node."""

    def __init__(
        self,
        system: System,
        make_listener: Callable[[Node], NodeListener],
        options: HostOptions,
        write_log: Write,
        together: Callable[[], AbstractContextManager[None]],
    ) -> None:
        """``make_listener(node)`` returns the listener of a node.

        ``write_log`` receives what other processes of the system print. What their nodes report
        within the context manager ``together`` is handled together.
        """
        self._system = system
        self._make_listener = make_listener
        self._options = options
        self._seen_messages = MessageSnapshots() if options.check_mutation else None
        self._router = LocalRouter({})
        self._process: ProcessContext  # set by join()
        self._nodes: Mapping[str, ManagedNode] = {}
        self.executors = {executor.name.value: executor for executor in system.executors}
        self.loops: dict[str, Loop] = {}
        self.clock = options.clock
        self._log_exception = exception_log(self.clock, write_log)
        self.chains = Chains(system, self.clock, tracing=options.tracing)
        self.children = ChildProcesses()
        self.run_state = RunState()
        namespace = join(system.namespace, system.name.value)
        self.other_processes = OtherProcesses(
            system, namespace, options.member_command, write_log, together
        )

    def join(self, process: ProcessContext, nodes: Mapping[str, ManagedNode]) -> str | None:
        """Create the nodes in this process, and let them share messages there.

        ``nodes`` are those that have been created, by their keys. Return why the middleware does
        not allow that, or None.
        """
        self._process = process
        self._nodes = nodes
        is_virtual = self.clock.is_virtual
        shared = shared_channels(self._system, in_virtual_time=is_virtual)
        options = self._options
        self._router = LocalRouter(
            shared, options.instruments, options.recorder, in_virtual_time=is_virtual
        )
        return self._router.refusal

    def make(self, node: Node, before: ManagedNode | None = None) -> ManagedNode:
        """Create a node; ``before`` is the one that it replaces, whose statistics it keeps.

        Raises what its creation raises, such as ParameterError.
        """
        statistics = (
            Statistics(tracing=self._options.tracing) if before is None else before.statistics
        )
        loop = self._loop_of(self._executor_of(node))
        common = loop, self._make_listener(node), statistics, self._timeout_s(node), self.run_state
        if not node.in_process:
            return self._make_outside(
                node,
                OutsideContext(
                    *common,
                    manager=self._process.manager,
                    children=self.children,
                    log_level=self._log_level_of(node),
                    nodes=self._nodes,
                ),
            )
        options = NodeOptions(
            *common,
            chains=self.chains,
            router=self._router,
            process=self._process,
            seen_messages=self._seen_messages,
            make_library_node=partial(NodeOfBehavior, parameters={}),
            instruments=self._options.instruments,
        )
        if before is None:  # else the level may have been changed at run time
            set_level(node.full_name, self._log_level_of(node))
        kind = RunningNode if node.hosted_class is None else HostedNode
        return kind(node, options)

    def _make_outside(self, node: Node, context: OutsideContext) -> ManagedNode:
        if node.process is not None:
            process = self.other_processes.process(node.process.value, context)
            return MemberNode(node, process, context)
        if node.external is not None:
            return ExternalNode(node, node.external, context)
        if node.executable is not None:
            return ExecutableNode(node, node.executable, context)
        if node.component is not None:
            return ComponentNode(node, node.component, context)
        raise AssertionError(f"{node.full_name} runs in this process")

    def _loop_of(self, executor: Executor) -> Loop:
        name = executor.name.value
        if name not in self.loops:
            self.loops[name] = Loop(
                name, self._on_exception, executor.kind, executor.threads, self.clock
            )
        return self.loops[name]

    def _timeout_s(self, node: Node) -> float:
        override_s = self._options.transition_timeout_s
        return node.supervision.timeout_ms / 1000.0 if override_s is None else override_s

    def _log_level_of(self, node: Node) -> LogLevel:
        return self._options.log_level if node.log_level is None else node.log_level.value

    def _executor_of(self, node: Node) -> Executor:
        """Return the executor that runs the node: by default ``default``, an event loop.

        A hosted class has an event loop of its own by default: its callbacks may block. In virtual
        time, each class has one, and all other nodes have one together. One loop drives all nodes
        outside the process.
        """
        if not node.in_process:
            return Executor(Located(_OUTSIDE, node.span), ExecutorKind.EVENTS, node.span)
        is_virtual = self.clock.is_virtual
        if node.executor is not None and not is_virtual:
            return self.executors[node.executor.value]
        key = DEFAULT_EXECUTOR if node.hosted_class is None else node.full_name
        own = Executor(Located(key, node.span), ExecutorKind.EVENTS, node.span)
        return own if is_virtual else self.executors.get(key, own)

    def _on_exception(self, what: str, error: BaseException) -> None:
        """Log an exception that leaves a callback, unless its node was only deactivated."""
        if not isinstance(error, CallCancelled):
            self._log_exception(what, error)
