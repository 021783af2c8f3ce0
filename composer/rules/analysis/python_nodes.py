"""The Python behaviors and classes of a system, read once for all rules."""

from __future__ import annotations

from composer.python_code.nodes import ClassOfNode, NodeClass, node_classes, use_of
from composer.rules.analysis.context import Context


def behaviors(context: Context) -> tuple[NodeClass, ...]:
    """Return every node that names a behavior, with its source."""
    return tuple(item for item in context.once(_classes) if item[0].behavior is not None)


def distinct_behaviors(context: Context) -> tuple[NodeClass, ...]:
    """Return one node for each behavior and each set of ports, timers and parameters."""
    first: dict[object, NodeClass] = {}
    for node, source in behaviors(context):
        first.setdefault(use_of(node, source), (node, source))
    return tuple(first.values())


def hosted_classes(context: Context) -> tuple[ClassOfNode, ...]:
    """Return every node with a class, and the source of the class."""
    return tuple(
        ClassOfNode(node, node.hosted_class, source)
        for node, source in context.once(_classes)
        if node.hosted_class is not None and node.behavior is None
    )


def distinct_classes(context: Context) -> tuple[ClassOfNode, ...]:
    """Return the first node of each class."""
    first: dict[int, ClassOfNode] = {}
    for item in hosted_classes(context):
        first.setdefault(id(item.source), item)
    return tuple(first.values())


def _classes(context: Context) -> tuple[NodeClass, ...]:
    return node_classes(context.system)
