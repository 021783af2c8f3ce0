"""Classes that do what a hosted node cannot: spin, create nodes, block, bring their own context."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python_nodes import hosted_classes
from composer.diagnostics import Diagnostic, error, warning
from composer.model import ExecutorKind, Node, System
from composer.model.dependencies import dependency_edges
from composer.python_code.nodes import ClassOfNode
from composer.python_code.scopes import Call
from composer.python_code.trees import SCOPES, is_none, span_of, walk
from composer.rules.python.definitions import as_warning, rclpy_class

_IMPORT = "import rclpy\n"
_ASKING = '\n    def ask(self):\n        return input("name: ")\n'

CLASS_SPINS = error(
    code="RC464",
    name="class-spins",
    summary="The constructor of a class spins its node.",
    why=(
        "rclpy.spin returns when the process ends, so the node would never be configured. "
        "The composer calls the callbacks of the class."
    ),
    bad=rclpy_class("rclpy.spin(self)", head=_IMPORT),
    good=rclpy_class(head=_IMPORT, methods="\n\ndef main():\n    rclpy.spin(Talker())\n"),
)
CLASS_SECOND_NODE = error(
    code="RC465",
    name="class-second-node",
    summary="A class creates a second ROS node.",
    why=(
        "Nothing would spin the second node, and it would not follow the lifecycle. Every "
        "node of a system is declared."
    ),
    bad=rclpy_class('self.helper = rclpy.create_node("helper")', head=_IMPORT),
    good=rclpy_class(),
)
CLASS_CONTEXT = error(
    code="RC466",
    name="class-context",
    summary="A class gives its node a context or command-line arguments of its own.",
    why=(
        "A hosted node joins the ROS graph with the context of the system, and its names and "
        "parameters come from YAML."
    ),
    bad=rclpy_class().replace('("talker")', '("talker", cli_args=["--ros-args"])'),
    good=rclpy_class(),
)
CLASS_BLOCKS = warning(
    code="RC467",
    name="class-blocks",
    summary="A class blocks a thread that others need, or waits in its constructor.",
    why=(
        "While a callback sleeps or waits for a response, a single-threaded executor runs no "
        "other callback. By default each class has an event loop of its own, which another thread "
        "serves meanwhile. A constructor that waits for messages or a response needs the nodes "
        "that send them to be active before: only those that it depends on are. Input from the "
        "terminal would keep its node waiting, and so the whole bring-up."
    ),
    bad=rclpy_class(methods=_ASKING),
    good=rclpy_class(methods=_ASKING.replace("input", "str")),
)

_ALONE = "leave out 'executor': each class then has an event loop of its own"
_DEPENDS = "declare what it waits for: 'lifecycle: {depends_on: [...]}'"
#: Functions of rclpy that return when something has arrived.
_WAITS = frozenset(("spin_once", "spin_until_future_complete", "wait_for_message"))
_CREATORS = frozenset(
    {
        "rclpy.create_node",
        "rclpy.node.Node",
        "rclpy.lifecycle.LifecycleNode",
        "rclpy.lifecycle.Node",
    }
)
#: Arguments of ``Node.__init__`` that a hosted node cannot have, and what to do instead.
_REFUSED = {
    "context": "leave it out, or run the program as an 'executable'",
    "cli_args": "use 'remappings' and 'parameters' of the node",
}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the calls of all methods of every class."""
    for item in hosted_classes(context):
        yield from _constructor(item)
        yield from _second_nodes(item)
        yield from _blocking_calls(item, context.system)
        yield from _waiting_constructor(item, context.system)


def _constructor(item: ClassOfNode) -> Iterator[Diagnostic]:
    name = item.source.reference.class_name
    constructor = item.constructor
    if constructor is None or constructor.node is None:
        return
    for call in constructor.calls:
        if call.name == "rclpy.spin" and not call.deferred:
            rule = as_warning(CLASS_SPINS, unless=item.is_certain(call.span))
            message = f"the constructor of '{name}' calls rclpy.spin, which never returns"
            hint = "spin in the main function of the program, or run it as an 'executable'"
            yield item.diagnostic(rule, message, call.span, hint)
    given = {
        argument.arg for argument in ast.walk(constructor.node.args) if hasattr(argument, "arg")
    }
    for node in walk(constructor.node.body, closed=SCOPES):
        match node:
            case ast.Call(func=ast.Attribute(attr="__init__") as function, keywords=keywords):
                span = span_of(function, constructor.span.file)
            case _:
                continue
        rule = as_warning(CLASS_CONTEXT, unless=item.is_certain(span))
        for keyword in keywords:
            is_passed_on = getattr(keyword.value, "id", None) in given  # it may be None
            if keyword.arg in _REFUSED and not (is_none(keyword.value) or is_passed_on):
                message = f"'{name}' gives its node a '{keyword.arg}' of its own"
                yield item.diagnostic(rule, message, span, _REFUSED[keyword.arg])


def _second_nodes(item: ClassOfNode) -> Iterator[Diagnostic]:
    name = item.source.reference.class_name
    for method in item.source.methods:
        for call in method.calls:
            if call.name in _CREATORS:
                rule = as_warning(CLASS_SECOND_NODE, unless=item.is_certain(call.span))
                message = f"'{method.name}' of '{name}' creates a second node"
                hint = "declare it as a node of the system, or run the program as an 'executable'"
                yield item.diagnostic(rule, message, call.span, hint)


def _blocking_calls(item: ClassOfNode, system: System) -> Iterator[Diagnostic]:
    """Report input from the terminal, and waiting where the executor does not allow it."""
    name = item.source.reference.class_name
    others = list(_on_same_thread(item.node, system))
    for method in item.source.methods:
        what = f"'{method.name}' of '{name}'"
        for call in method.calls:
            if call.name == "input" and not call.deferred:
                message = f"{what} reads from the terminal"
                hint = "run the program in a terminal of its own, outside the system"
                yield item.diagnostic(CLASS_BLOCKS, message, call.span, hint)
            elif others[1:] and call.name == "time.sleep" and method.name != "__init__":
                other = next(other for other in others if other is not item.node)
                message = f"{what} sleeps, and node '{other.name}' waits"
                yield item.diagnostic(CLASS_BLOCKS, message, call.span, _ALONE)
            elif others and _waits_for_response(call):
                message = f"{what} waits for a response that its only thread would have to receive"
                yield item.diagnostic(CLASS_BLOCKS, message, call.span, _ALONE)


def _waiting_constructor(item: ClassOfNode, system: System) -> Iterator[Diagnostic]:
    """Report a constructor that waits for nodes of the system that need not be active yet."""
    constructor = item.constructor
    key = item.node.name.value
    if constructor is None or len(system.nodes) == 1:
        return
    if any(edge.node == key for edge in dependency_edges(system)):
        return
    for call in constructor.calls:
        if not call.deferred and call.name.rpartition(".")[2] in _WAITS:
            name = item.source.reference.class_name
            message = f"the constructor of '{name}' waits, maybe for a node that is not active yet"
            yield item.diagnostic(CLASS_BLOCKS, message, call.span, _DEPENDS)
            return


def _on_same_thread(node: Node, system: System) -> Iterator[Node]:
    """Yield the nodes of a single-threaded executor, this one included."""
    kinds = {item.name.value: item.kind for item in system.executors}
    name = node.executor.value if node.executor is not None else None
    if kinds.get(name or "") is ExecutorKind.SINGLE_THREADED:
        yield from (
            other for other in system.nodes if other.executor and other.executor.value == name
        )


def _waits_for_response(call: Call) -> bool:
    """Return whether it looks like ``self.client.call(request)``."""
    return call.name.startswith("self.") and call.name.endswith(".call") and not call.awaited
