"""The rclpy node of a behavior, for libraries such as tf2_ros and message_filters."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.parameter import Parameter

from composer.model import Node, Port
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.hosting.adopted_node import AdoptedNode
from composer.runtime.hosting.declared_ports import DeclaredPorts, report_undeclared
from composer.runtime.hosting.dispatch import install
from composer.runtime.hosting.instance import (
    HostedLogger,
    Instance,
    InstanceSettings,
    SharedState,
    changed_parameters,
)
from composer.runtime.node.local_node import LocalNode
from composer.runtime.ports import PortSet


class NodeOfBehavior:
    """Adopts the ROS node of a behavior, from its configuration to its cleanup.

    What is created with it is gated by the lifecycle state. None of it is a declared port.
    """

    def __init__(self, owner: LocalNode, parameters: dict[str, Parameter]) -> None:
        """``parameters`` were set at run time; those that are set now are added at the end."""
        install()
        self._parameters = parameters
        context, _ = owner.contexts
        self._shared = SharedState(context.node)
        self._instance = Instance(
            owner.contexts,
            DeclaredPorts(
                replace(owner.model, ports=()), partial(self._report, owner.model, context)
            ),
            InstanceSettings(
                overrides=dict(parameters),
                logger=HostedLogger(context.log, context.node.get_logger().name),
                action_names={},
                finish=lambda reason: context.error_log.error("node", reason),
                request=lambda transition: context.error_log.error("node", transition),
                current_state=lambda: (0, owner.state),
                may_block=False,
            ),
        )
        node: Any = AdoptedNode.__new__(AdoptedNode)
        node._composer_instance = self._instance
        AdoptedNode.__init__(node)
        self.node = node

    @staticmethod
    def _report(model: Node, context: NodeContext, port: Port) -> None:
        declared = model.ports_of(port.kind)
        if all(item.full_name != port.full_name for item in declared):
            report_undeclared(context, port)

    @property
    def entities(self) -> PortSet:
        """What was created with the node."""
        return self._instance.entities

    def end(self) -> None:
        """Release the node: its handle is not valid any more."""
        self._parameters.update(changed_parameters(self.node, self._instance.declared))
        self._instance.ended.set()
        for executor in self._instance.executors:
            executor.shutdown(0.0)
        self._shared.restore()
