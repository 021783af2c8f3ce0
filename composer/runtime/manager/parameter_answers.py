"""Answers about the parameters of a node, as its own parameter services give them.

rclpy answers only through services that it makes itself; the manager answers for nodes that have
none (rcl_interfaces/srv).
"""

from __future__ import annotations

from collections.abc import Iterable

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterDescriptor, ParameterValue, SetParametersResult
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter


def names(node: Node) -> list[str]:
    """Return the names of all parameters of a node."""
    return list(node.list_parameters([], 0).names)


def value(node: Node, name: str) -> ParameterValue:
    """Return the value of a parameter; one that is not there is not set."""
    return node.get_parameter_or(name, Parameter(name)).get_parameter_value()


def description(node: Node, name: str) -> ParameterDescriptor:
    """Return what is declared of a parameter; only the name of one that is not there."""
    try:
        return node.describe_parameter(name)
    except ParameterNotDeclaredException:
        return ParameterDescriptor(name=name)


def assign(node: Node, changes: Iterable[ParameterMessage]) -> SetParametersResult:
    """Set parameters, all of them or none; return what became of it."""
    try:
        return node.set_parameters_atomically(list(map(Parameter.from_parameter_msg, changes)))
    except ParameterNotDeclaredException as error:
        return SetParametersResult(successful=False, reason=str(error))
