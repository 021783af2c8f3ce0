"""Classes of nodes that are missing, or do what a hosted node cannot: spin, block, create nodes."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, suggestion
from composer.model import ExecutorKind, Node, System
from composer.model.dependencies import dependency_edges
from composer.python_code.scopes import Call
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, is_none, span_of, walk
from composer.rules.analysis.context import ClassOfNode, Context, hosted_classes
from composer.rules.behaviors import BLOCKING_CALL, WRONG_CLASS
from composer.rules.python import NOT_INSTALLED, as_warning, missing, unnamed

CLASS_ARGUMENTS = error("RC463", "class-arguments")
UNSUPPORTED_CLASS = error("RC464", "unsupported-class")


def check_classes(context: Context) -> Iterator[Diagnostic]:
    """Check that every class can be read, is a node, and takes the arguments that it is given.

    A node type alone does not need arguments; systems may add them.
    """
    for node in context.system.nodes:
        if node.hosted_class is not None:
            yield from unnamed(node.hosted_class.reference, "class")
    for item in hosted_classes(context):
        source = item.source
        yield from missing(source, NOT_INSTALLED)
        if source.complete and source.class_span is not None and not source.is_rclpy_node:
            message = f"class '{source.reference.class_name}' is not derived from rclpy's Node"
            hint = "for a class without ROS, write 'behavior' instead of 'class'"
            yield item.diagnostic(WRONG_CLASS, message, source.class_span, hint)
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


def check_hosting(context: Context) -> Iterator[Diagnostic]:
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
            rule = as_warning(UNSUPPORTED_CLASS, unless=item.is_certain(call.span))
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
        rule = as_warning(UNSUPPORTED_CLASS, unless=item.is_certain(span))
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
                rule = as_warning(UNSUPPORTED_CLASS, unless=item.is_certain(call.span))
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
                yield item.diagnostic(BLOCKING_CALL, message, call.span, hint)
            elif others[1:] and call.name == "time.sleep" and method.name != "__init__":
                other = next(other for other in others if other is not item.node)
                message = f"{what} sleeps, and node '{other.name}' waits"
                yield item.diagnostic(BLOCKING_CALL, message, call.span, _ALONE)
            elif others and _waits_for_response(call):
                message = f"{what} waits for a response that its only thread would have to receive"
                yield item.diagnostic(BLOCKING_CALL, message, call.span, _ALONE)


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
            yield item.diagnostic(BLOCKING_CALL, message, call.span, _DEPENDS)
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
