"""What the YAML file declares of a node with a class, against what the class creates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, Label, Severity, error, nearest, suggestion
from composer.base.spelling import misspelled
from composer.model import (
    USE_SIM_TIME,
    Channel,
    ChannelKind,
    Parameter,
    ParameterType,
    Port,
    PortKind,
)
from composer.model.qos import incompatibilities
from composer.python_code.nodes import declared_parameters
from composer.rules.analysis.class_ports import (
    CreatedPort,
    all_created_ports,
    created_ports,
    passes_node_on,
)
from composer.rules.analysis.context import ClassOfNode, Context, distinct_classes, hosted_classes
from composer.rules.analysis.subjects import type_subject
from composer.rules.python import as_warning

CLASS_PORT = error("RC487", "class-port")
CLASS_PARAMETER = error("RC485", "class-parameter")

_KINDS = frozenset({PortKind.PUBLISHER, PortKind.SUBSCRIPTION, PortKind.SERVICE, PortKind.CLIENT})
#: The policies that decide whether endpoints match.
_POLICIES = ("reliability", "durability", "deadline_ms", "liveliness")
_OF_EVERY_NODE = (USE_SIM_TIME, "start_type_description_service")
_TYPES = frozenset(item.value for item in ParameterType)


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
