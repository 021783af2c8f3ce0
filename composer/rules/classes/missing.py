"""Classes that are missing, not installed, no nodes, or constructed with wrong arguments."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import class_name_hint
from composer.analysis.python_nodes import hosted_classes
from composer.diagnostics import Diagnostic, Label, suggestion
from composer.model import BehaviorReference
from composer.python_code.nodes.classes import ClassOfNode
from composer.python_code.source import Method, NearbyModules
from composer.rules.python.definitions import error, info, rclpy_class

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
    bad="""\
system: robot
nodes:
  talker: {class: "nodes_for_mars.talker:Talker"}
""",
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
    """Check that every class can be read, is a node, and takes the arguments that it is given."""
    for node in context.system.nodes:
        if node.hosted_class is not None:
            yield from _unnamed(node.hosted_class.reference)
    for item in hosted_classes(context):
        yield from _missing(item)
        source = item.source
        if source.complete and source.class_span is not None and not item.is_node:
            message = f"class '{source.reference.class_name}' is not derived from rclpy's Node"
            hint = "for a class without ROS, write 'behavior' instead of 'class'"
            yield item.diagnostic(CLASS_NOT_A_NODE, message, source.class_span, hint)
        constructor = item.constructor
        if constructor is not None and constructor.known and constructor.node is not None:
            unknown = list(_unknown_arguments(item, constructor))
            yield from _missing_arguments(item, constructor, len(unknown))
            yield from unknown


def _unnamed(reference: BehaviorReference) -> Iterator[Diagnostic]:
    text = reference.text
    if not ((reference.module and reference.class_name) or is_unresolved(text.value)):
        message = f"class '{text}' is not 'module:Class'"
        yield Diagnostic(CLASS_MISSING, message, text.span, hint=class_name_hint(text.value))


def _missing(item: ClassOfNode) -> Iterator[Diagnostic]:
    source, reference = item.source, item.hosted.reference
    if source.problem_span is not None:
        return  # another rule reports it in the module
    if source.problem is not None:
        message = f"module '{reference.module}' {source.problem}"
        yield Diagnostic(CLASS_MISSING, message, item.span)
    elif item.nearby is not None:
        yield _missing_module(item, item.nearby)
    elif source.module_found and not source.class_found:
        message = f"module '{reference.module}' has no class '{reference.class_name}'"
        hint = suggestion(reference.class_name, source.class_names)
        yield Diagnostic(CLASS_MISSING, message, item.span, hint=hint)


def _missing_module(item: ClassOfNode, nearby: NearbyModules) -> Diagnostic:
    """Return the diagnostic of a module that is most likely misspelled, or not installed."""
    if nearby.package:
        message = f"package '{nearby.package}' has no module '{nearby.missing}'"
        hint = suggestion(nearby.missing, nearby.names)
        return Diagnostic(CLASS_MISSING, message, item.span, hint=hint)
    if nearby.is_misspelled:
        message = f"no Python module named '{nearby.missing}'"
        return Diagnostic(CLASS_MISSING, message, item.span, hint=nearby.hint)
    module = item.hosted.reference.module
    message = f"module '{module}' is not found on this computer, so its class is not checked"
    expected = (
        f"expected {module.replace('.', '/')}.py next to the YAML file, among the node types, or"
        " on Python's module search path"
    )
    return Diagnostic(CLASS_NOT_INSTALLED, message, item.span, hint=nearby.hint or expected)


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
    required = len(constructor.arguments) - constructor.optional
    names = (*constructor.arguments[:required], *constructor.keywords)
    missing = [name for name in names if name not in given]
    if len(missing) > misspelled:
        listed = ", ".join(f"'{name}'" for name in missing)
        message = f"the constructor of '{item.source.reference.class_name}' needs {listed}"
        hint = (
            f"add 'arguments: {{{missing[0]}: ...}}'; for an object that YAML cannot write, derive"
            " a class that creates it"
        )
        yield item.diagnostic(CLASS_ARGUMENTS, message, constructor.span, hint)
