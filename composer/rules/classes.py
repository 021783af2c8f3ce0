"""Classes of nodes: missing, unlike their declaration, or doing what a hosted node cannot."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, Label, Severity, error, nearest, suggestion
from composer.base.spelling import misspelled
from composer.model import (
    USE_SIM_TIME,
    Channel,
    ChannelKind,
    ExecutorKind,
    Node,
    Parameter,
    ParameterType,
    Port,
    PortKind,
    System,
)
from composer.model.dependencies import dependency_edges
from composer.model.qos import incompatibilities
from composer.python_code.nodes import declared_parameters
from composer.python_code.problems import Family
from composer.python_code.scopes import Call
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, is_none, span_of, walk
from composer.rules.analysis.class_ports import (
    CreatedPort,
    all_created_ports,
    created_ports,
    passes_node_on,
)
from composer.rules.analysis.context import ClassOfNode, Context, distinct_classes, hosted_classes
from composer.rules.analysis.subjects import type_subject
from composer.rules.behaviors import BLOCKING_CALL, WRONG_CLASS
from composer.rules.python import as_warning, missing, unnamed

CLASS_ARGUMENTS = error("RC463", "class-arguments")
UNSUPPORTED_CLASS = error("RC464", "unsupported-class")
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
CLASS_PORT = error("RC487", "class-port")
CLASS_PARAMETER = error("RC485", "class-parameter")
_KINDS = frozenset({PortKind.PUBLISHER, PortKind.SUBSCRIPTION, PortKind.SERVICE, PortKind.CLIENT})
#: The policies that decide whether endpoints match.
_POLICIES = ("reliability", "durability", "deadline_ms", "liveliness")
_OF_EVERY_NODE = (USE_SIM_TIME, "start_type_description_service")
_TYPES = frozenset(item.value for item in ParameterType)


def check_classes(context: Context) -> Iterator[Diagnostic]:
    """Check that every class can be read, is a node, and takes the arguments that it is given.

    A node type alone does not need arguments; systems may add them.
    """
    for node in context.system.nodes:
        if node.hosted_class is not None:
            yield from unnamed(node.hosted_class.reference, "class")
    for item in hosted_classes(context):
        source = item.source
        yield from missing(source, Family.NOT_INSTALLED.value)
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


def check_interfaces(context: Context) -> Iterator[Diagnostic]:
    """Compare the ports and parameters of nodes with their classes."""
    for item in hosted_classes(context):
        if item.node.ports:
            yield from _missing_ports(item, context)
            yield from _different_ports(item, context)
        if item.node.parameters or item.node.undeclared_parameters:
            yield from _parameters(item)


def _created_ports(context: Context) -> dict[int, list[CreatedPort]]:
    """Return what each class creates, by the identity of its source; nodes may share a class."""
    return {id(item.source): list(created_ports(item.source)) for item in distinct_classes(context)}


def _all_created_ports(context: Context) -> dict[int, list[CreatedPort] | None]:
    return {id(item.source): all_created_ports(item.source) for item in distinct_classes(context)}


def _missing_ports(item: ClassOfNode, context: Context) -> Iterator[Diagnostic]:
    """Report the declared ports that are not among those that the class creates."""
    ports = [port for port in item.node.ports if port.kind in _KINDS]
    created = context.once(_all_created_ports)[id(item.source)]
    for port in ports if created is not None else ():
        names = [other.name or "" for other in created or () if other.kind is port.kind]
        declared = {_last(other.ros_name.value) for other in ports if other.kind is port.kind}
        others = [name for name in names if _last(name) not in declared]
        name = port.ros_name.value
        # without another name, the class may be one that is not finished
        if _last(name) in map(_last, names) or not others:
            continue
        message = f"class '{item.hosted.reference.class_name}' creates no {port.kind} '{name}'"
        listed = " and ".join(f"'{other}'" for other in others)
        hint = suggestion(name, others, limit=0) or f"it creates {listed}"
        # Connections may name a port as the class does.
        meant = sorted({port.name.value, *others})
        subjects = tuple(("port", f"{item.node.name}.{other}") for other in meant)
        rule = as_warning(CLASS_PORT)
        yield Diagnostic(rule, message, port.ros_name.span, (), hint, subjects)


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _different_ports(item: ClassOfNode, context: Context) -> Iterator[Diagnostic]:
    """Report the ports that the class creates with another type or QoS."""
    created = context.once(_created_ports)[id(item.source)]
    for port in item.node.ports:
        same = [
            other
            for other in created
            if other.kind is port.kind and other.name == port.ros_name.value
        ]
        types = [other for other in same if other.interface is not None]
        what = f"class '{item.hosted.reference.class_name}' creates {port.kind} '{port.ros_name}'"
        if types and port.interface.value not in {other.interface for other in types}:
            message = f"{what} with type {types[0].interface}, not {port.interface}"
            label = Label(types[0].span, "created here")
            rule = as_warning(CLASS_PORT, unless=item.is_certain(types[0].span))
            subjects = (type_subject(port),)
            yield Diagnostic(rule, message, port.interface.span, (label,), subjects=subjects)
        elif len(same) == 1 and port.qos.known:
            override = ("qos override", f"{item.node.name}.{port.name}")
            for found in _different_qos(port, same[0], what, context):
                # A class that ignores overrides does not have the profile of the model.
                is_model = port.qos.overridden <= same[0].overridable
                yield found if is_model else replace(found, subjects=(override,))


def _different_qos(
    port: Port, created: CreatedPort, what: str, context: Context
) -> Iterator[Diagnostic]:
    """Report a policy that decides about matches; it is a warning if another end does not match."""
    declared, qos = port.qos.profile, created.qos
    if qos is None:
        return
    is_publisher = port.kind is PortKind.PUBLISHER
    topic = context.once(_topics).get(port.full_name)
    ends = () if topic is None else topic.sinks if is_publisher else topic.sources
    profiles = [end.port.qos.profile for end in ends]
    pairs = [(qos, other) if is_publisher else (other, qos) for other in profiles]
    is_problem = any(incompatibilities(*pair) for pair in pairs)
    rule = replace(CLASS_PORT, severity=Severity.WARNING if is_problem else Severity.INFO)
    for policy in _compared_policies(port, created):
        here, there = getattr(declared, policy), getattr(qos, policy)
        if here != there:
            message = f"{what} with {policy} {_value(there)}, not {_value(here)}"
            label = Label(created.span, "created here")
            yield Diagnostic(rule, message, port.qos.own_span(policy), (label,))
            return  # another profile, most likely


def _topics(context: Context) -> dict[str, Channel]:
    return {item.name: item for item in context.channels if item.kind is ChannelKind.TOPIC}


def _compared_policies(port: Port, created: CreatedPort) -> list[str]:
    """Return the policies to compare: from the file, and overrides that the class ignores."""
    policies = _POLICIES if port.qos.explicit else ()
    overridden, ignored = port.qos.overridden, port.qos.overridden - created.overridable
    return [
        *(policy for policy in policies if policy not in overridden or policy in ignored),
        *sorted(ignored.difference(policies)),
    ]


def _value(policy: object) -> str:
    return "unlimited" if policy is None else str(policy)


def _parameters(item: ClassOfNode) -> Iterator[Diagnostic]:
    """Report the parameters that the class does not declare, or with another type."""
    class_name = item.hosted.reference.class_name
    declared = declared_parameters(item.source)
    for parameter in (*item.node.parameters, *item.node.undeclared_parameters):
        name, given = parameter.name.value, parameter.type.value
        if declared.is_complete and not name.startswith("qos_overrides."):
            yield from _undeclared(item, parameter, (*declared.types, *_OF_EVERY_NODE))
        type_ = declared.types.get(name)
        if type_ is not None and given in _TYPES and type_.value != given:
            message = f"class '{class_name}' declares parameter '{name}' as {type_}, not {given}"
            label = Label(type_.span, "declared here")
            rule = as_warning(CLASS_PARAMETER, unless=item.is_certain(type_.span))
            yield Diagnostic(rule, message, parameter.type.span, (label,))


def _undeclared(
    item: ClassOfNode, parameter: Parameter, names: tuple[str, ...]
) -> Iterator[Diagnostic]:
    """Report a parameter that is not among the ``names`` that the class declares.

    One of a parameter file may be for other nodes: it is only reported if it is misspelled.
    """
    name = parameter.name.value
    if name in names:
        return
    if item.node.parameter(name) is None:
        close = misspelled(name, names)
        is_reported = close is not None
    else:
        close = nearest(name, names)
        is_reported = close is not None or not passes_node_on(item.source)
    if is_reported:
        message = f"class '{item.hosted.reference.class_name}' declares no parameter '{name}'"
        hint = f"did you mean '{close}'?" if close is not None else None
        yield Diagnostic(
            as_warning(CLASS_PARAMETER),
            message,
            parameter.name.span,
            hint=hint,
            relies_on=(("undeclared parameter", name),),
        )
