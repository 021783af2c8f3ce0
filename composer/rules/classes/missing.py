"""Classes that are missing, not installed, no nodes, or constructed with wrong arguments."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python_nodes import hosted_classes
from composer.diagnostics import Diagnostic, Label, error, info, suggestion
from composer.python_code.nodes import ClassOfNode
from composer.python_code.syntax import Method
from composer.rules.python.definitions import rclpy_class
from composer.rules.python.missing import missing, unnamed

_WITH_PORT = rclpy_class(keys="    arguments: {port: /dev/ttyUSB0}\n").replace(
    "(self)", "(self, port)"
)

CLASS_MISSING = error(
    code="RC460",
    name="class-missing",
    summary="The class, or its module in a package that exists, is missing or unreadable.",
    why="The node cannot be configured without its class. The module is parsed, not imported.",
    bad=rclpy_class().replace("robot_nodes:Talker", "robot_nodes:Talkr"),
    good=rclpy_class(),
)
CLASS_NOT_INSTALLED = info(
    code="RC461",
    name="class-not-installed",
    summary="The Python module of a class is not found on this computer.",
    why=(
        "The class is not checked, and the node cannot be configured on a computer without "
        "it. If it is installed where the system runs, ignore this."
    ),
    bad=rclpy_class().replace("robot_nodes:", "nodes_for_mars.talker:"),
    good=rclpy_class(),
)
CLASS_NOT_A_NODE = error(
    code="RC462",
    name="class-not-a-node",
    summary="A class is not derived from rclpy's Node or LifecycleNode.",
    why="Only these classes create ROS nodes. A class without ROS is a behavior.",
    bad=rclpy_class().replace("(Node)", "").replace('super().__init__("talker")', "pass"),
    good=rclpy_class(),
)
CLASS_ARGUMENTS = error(
    code="RC463",
    name="class-arguments",
    summary="The `arguments` of a class are not those of its constructor.",
    why=(
        "The class is constructed with them as keyword arguments. A constructor that needs "
        "an object that YAML cannot write needs a subclass that creates it."
    ),
    bad=_WITH_PORT.replace("port:", "prt:"),
    good=_WITH_PORT,
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check that every class can be read, is a node, and takes the arguments that it is given.

    A node type alone does not need arguments; systems may add them.
    """
    for node in context.system.nodes:
        if node.hosted_class is not None:
            yield from unnamed(node.hosted_class.reference, "class", CLASS_MISSING)
    for item in hosted_classes(context):
        source = item.source
        yield from missing(source, CLASS_MISSING, CLASS_MISSING, CLASS_NOT_INSTALLED)
        if source.complete and source.class_span is not None and not source.is_rclpy_node:
            message = f"class '{source.reference.class_name}' is not derived from rclpy's Node"
            hint = "for a class without ROS, write 'behavior' instead of 'class'"
            yield item.diagnostic(CLASS_NOT_A_NODE, message, source.class_span, hint)
        constructor = item.constructor
        if constructor is not None and constructor.known and constructor.node is not None:
            unknown = list(_unknown_arguments(item, constructor))
            if not context.system.node_type:
                yield from _missing_arguments(item, constructor, len(unknown))
            yield from unknown


def _unknown_arguments(item: ClassOfNode, constructor: Method) -> Iterator[Diagnostic]:
    parameters = constructor.node.args if constructor.node is not None else None
    if parameters is None or parameters.kwarg is not None:
        return
    names = (*constructor.arguments, *(argument.arg for argument in parameters.kwonlyargs))
    class_name = item.source.reference.class_name
    for name, _ in item.hosted.arguments:
        if name.value not in names:
            message = f"the constructor of '{class_name}' has no argument '{name}'"
            label = Label(constructor.span, "the constructor")
            hint = suggestion(name.value, names)
            yield Diagnostic(CLASS_ARGUMENTS, message, name.span, (label,), hint)


def _missing_arguments(
    item: ClassOfNode, constructor: Method, misspelled: int
) -> Iterator[Diagnostic]:
    """Yield the arguments that are missing, unless as many are given under another name."""
    given = {name.value for name, _ in item.hosted.arguments}
    missing = [name for names in constructor.required for name in names if name not in given]
    if len(missing) > misspelled:
        listed = ", ".join(f"'{name}'" for name in missing)
        message = f"the constructor of '{item.source.reference.class_name}' needs {listed}"
        hint = (
            f"add 'arguments: {{{missing[0]}: ...}}'; for an object that YAML cannot write, derive"
            " a class that creates it"
        )
        yield item.diagnostic(CLASS_ARGUMENTS, message, constructor.span, hint)
