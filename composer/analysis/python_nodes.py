"""The Python behaviors and classes of a system, read once for all rules."""

from __future__ import annotations

from composer.analysis.context import Context
from composer.python_code.nodes import behaviors as of_behaviors
from composer.python_code.nodes import classes as of_classes
from composer.python_code.nodes.behaviors import NodeBehavior
from composer.python_code.nodes.classes import ClassOfNode


def behaviors(context: Context) -> tuple[NodeBehavior, ...]:
    """Return every node that names a behavior, with its source."""
    return context.once(_behaviors)


def distinct_behaviors(context: Context) -> tuple[NodeBehavior, ...]:
    """Return one node for each behavior and each set of ports, timers and parameters."""
    return context.once(_distinct_behaviors)


def hosted_classes(context: Context) -> tuple[ClassOfNode, ...]:
    """Return every node with a class, and the source of the class."""
    return context.once(_hosted_classes)


def distinct_classes(context: Context) -> tuple[ClassOfNode, ...]:
    """Return the first node of each class."""
    first: dict[int, ClassOfNode] = {}
    for item in hosted_classes(context):
        first.setdefault(id(item.source), item)
    return tuple(first.values())


def _behaviors(context: Context) -> tuple[NodeBehavior, ...]:
    return of_behaviors.behaviors(context.system)


def _distinct_behaviors(context: Context) -> tuple[NodeBehavior, ...]:
    first: dict[object, NodeBehavior] = {}
    for node, source in behaviors(context):
        first.setdefault(of_behaviors.use_of(node, source), (node, source))
    return tuple(first.values())


def _hosted_classes(context: Context) -> tuple[ClassOfNode, ...]:
    return of_classes.hosted_classes(context.system)
