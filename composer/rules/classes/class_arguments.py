"""Arguments that do not fit the constructor of a class."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import ClassOfNode, hosted_classes
from composer.behavior_source import Method
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC463",
        name="class-arguments",
        severity=Severity.ERROR,
        summary="The `arguments` of a class are not those of its constructor.",
        why=(
            "The class is constructed with them as keyword arguments. A constructor that needs "
            "an object that YAML cannot write needs a subclass that creates it."
        ),
        bad="""\
# file: system.yaml
system: robot
nodes:
  lidar: {class: robot_nodes:Lidar, arguments: {prt: /dev/ttyUSB0}}
# file: robot_nodes.py
from rclpy.node import Node


class Lidar(Node):
    def __init__(self, port):
        super().__init__("lidar")
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  lidar: {class: robot_nodes:Lidar, arguments: {port: /dev/ttyUSB0}}
# file: robot_nodes.py
from rclpy.node import Node


class Lidar(Node):
    def __init__(self, port):
        super().__init__("lidar")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the arguments with the signature of the constructor, where it is known."""
    for found in context.once(hosted_classes):
        constructor = found.constructor
        if constructor is None or not constructor.known or constructor.node is None:
            continue
        unknown = list(_unknown(found, constructor))
        yield from _missing(found, constructor, len(unknown))
        yield from unknown


def _unknown(found: ClassOfNode, constructor: Method) -> Iterator[Diagnostic]:
    parameters = constructor.node.args if constructor.node is not None else None
    if parameters is None or parameters.kwarg is not None:
        return
    names = (*constructor.arguments, *(item.arg for item in parameters.kwonlyargs))
    for name, _ in found.hosted.arguments:
        if name.value not in names:
            yield Diagnostic(
                RULE,
                f"the constructor of '{found.source.reference.class_name}' has no argument"
                f" '{name}'",
                name.span,
                related=(Label(constructor.span, "the constructor"),),
                hint=suggestion(name.value, names),
            )


def _missing(found: ClassOfNode, constructor: Method, misspelled: int) -> Iterator[Diagnostic]:
    """Yield the arguments that are missing, unless as many are given under another name."""
    given = {name.value for name, _ in found.hosted.arguments}
    required = len(constructor.arguments) - constructor.optional
    names = (*constructor.arguments[:required], *constructor.keywords)
    missing = [name for name in names if name not in given]
    if len(missing) > misspelled:
        listed = ", ".join(f"'{name}'" for name in missing)
        yield found.diagnostic(
            RULE,
            f"the constructor of '{found.source.reference.class_name}' needs {listed}",
            constructor.span,
            f"add 'arguments: {{{missing[0]}: ...}}'; for an object that YAML cannot write, derive"
            " a class that creates it",
        )
