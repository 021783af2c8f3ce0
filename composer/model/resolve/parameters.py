"""The parameters of nodes: declarations, values that a system sets, and what programs get."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Mapping as Map

from composer.base.fast_dataclass import dataclass, replace
from composer.base.source import Located
from composer.language.tree import (
    OPAQUE,
    Entry,
    Mapping,
    Plain,
    Scalar,
    Sequence,
    Tree,
    entries,
    flag,
    is_opaque,
    key,
    number,
    plain,
    plain_text,
    text_or_opaque,
)
from composer.model import (
    USE_SIM_TIME,
    Node,
    Parameter,
    ParameterSection,
    ParameterType,
    UnknownKey,
)
from composer.model.qos_overrides import PREFIX, override_parameter
from composer.model.resolve.node_settings import NodeNames
from composer.model.resolve.parameter_files import SCALAR_TYPES, ParameterFiles

#: The type of a parameter whose bare value has no clear type, such as an empty list.
UNKNOWN_TYPE = ""
_USE_SIM_TIME_DESCRIPTION = "Whether the node uses the time of /clock."
#: Names that match every node. rcl joins sections of the same name, at the place of the first.
_FIRST_FOR_ALL, _LAST_FOR_ALL = "/**/*", "/*/**"


def read_parameters(tree: Tree | None) -> tuple[Parameter, ...]:
    """Return the declared ``parameters`` of a node type or an inline node.

    A bare value declares a parameter of its type with that default.
    """
    return tuple(_declaration(entry) for entry in entries(tree))


def with_use_sim_time(
    parameters: tuple[Parameter, ...], given: Map[str, Entry]
) -> tuple[Parameter, ...]:
    """Return the parameters, with ``use_sim_time`` added if a value is given for it."""
    entry = given.get(USE_SIM_TIME)
    if entry is None or any(item.name.value == USE_SIM_TIME for item in parameters):
        return parameters
    kind = Located(str(ParameterType.BOOL), entry.key.span)
    own = Parameter(
        key(entry), kind, None, None, entry.key.span, description=_USE_SIM_TIME_DESCRIPTION
    )
    return (*parameters, own)


def with_values(parameters: Iterable[Parameter], given: Map[str, Entry]) -> tuple[Parameter, ...]:
    """Return the parameters with the given values."""
    return tuple(
        _with_value(item, given[item.name.value].value) if item.name.value in given else item
        for item in parameters
    )


def undeclared(parameters: Iterable[Parameter], given: Map[str, Entry]) -> list[Entry]:
    """Return the given values of other parameters."""
    known = {item.name.value for item in parameters}
    return [entry for name, entry in given.items() if name not in known]


def unknown_parameters(
    parameters: Iterable[Parameter], given: Map[str, Entry]
) -> tuple[UnknownKey, ...]:
    """Return the given names that are none of the parameters."""
    names = tuple(item.name.value for item in parameters)
    return tuple(
        UnknownKey("parameters", key(entry), names) for entry in undeclared(parameters, given)
    )


def bare_parameter(entry: Entry) -> Parameter:
    """Return the parameter that a value without a declaration declares."""
    kind = _bare_type(plain(entry.value))
    if entry.name == USE_SIM_TIME and kind != OPAQUE:
        kind = ParameterType.BOOL
    value = _value(entry.value, kind)
    return Parameter(
        name=key(entry),
        type=Located(str(kind), entry.value.span),
        value=value,
        default=value,
        span=entry.key.span,
    )


def inferred_type(value: Plain) -> str | None:
    """Return the parameter type of ``value``; None for null, maps and mixed lists."""
    if isinstance(value, list) and {type(item) for item in value} == {int, float}:
        return "double_array"
    return rclpy_type(value)


def rclpy_type(value: object) -> str | None:
    """Return the type that rclpy infers from ``value``; None if it refuses it.

    Unlike in YAML files, a list of integers and doubles is refused.
    """
    if isinstance(value, list):
        kinds = {SCALAR_TYPES.get(type(item)) for item in value}
        kind = kinds.pop() if len(kinds) == 1 else None
        return f"{kind}_array" if kind is not None else None
    return SCALAR_TYPES.get(type(value))


def promoted(value: Plain, kind: str) -> Plain:
    """Return ``value`` with integers converted to doubles if ``kind`` is a double type."""
    if kind == ParameterType.DOUBLE and _is_whole(value):
        return _as_double(value)
    if kind == ParameterType.DOUBLE_ARRAY and isinstance(value, list):
        return [_as_double(item) if _is_whole(item) else item for item in value]
    return value


def _is_whole(value: Plain) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _as_double(value: Plain) -> Plain:
    try:
        return float(value)  # type: ignore[arg-type]  # only called with integers
    except OverflowError:
        return value


def _declaration(entry: Entry) -> Parameter:
    if not isinstance(entry.value, Mapping):
        return bare_parameter(entry)
    tree = entry.value
    kind = text_or_opaque(tree.get("type"), entry.key.span)
    default = _value(tree.get("default"), kind.value)
    choices = tree.get("choices")
    return Parameter(
        name=key(entry),
        type=kind,
        value=default,
        default=default,
        span=entry.key.span,
        minimum=number(tree.get("minimum")),
        maximum=number(tree.get("maximum")),
        step=number(tree.get("step")),
        choices=_choices(choices, kind.value) if isinstance(choices, Sequence) else None,
        read_only=flag(tree.get("read_only"), default=False),
        unit=plain_text(tree.get("unit")),
        description=plain_text(tree.get("description")),
    )


def _bare_type(value: Plain) -> str:
    items = value if isinstance(value, list) else [value]
    if value is None or any(isinstance(item, str) and is_opaque(item) for item in items):
        return OPAQUE
    return inferred_type(value) or UNKNOWN_TYPE


def _with_value(parameter: Parameter, tree: Tree) -> Parameter:
    value = _value(tree, parameter.type.value)
    return replace(parameter, value=value) if value is not None else parameter


def _value(tree: Tree | None, kind: str) -> Located[Plain] | None:
    """Return a value; None for null and maps, which ROS parameters cannot hold."""
    if tree is None or isinstance(tree, Mapping):
        return None
    if isinstance(tree, Scalar) and tree.value is None:
        return None
    return Located(promoted(plain(tree), kind), tree.span)


def _choices(tree: Sequence, kind: str) -> Located[tuple[Plain, ...]]:
    return Located(tuple(promoted(plain(item), kind) for item in tree.items), tree.span)


@dataclass(frozen=True, slots=True)
class GivenValues:
    """The values for a node by parameter. A later field takes precedence.

    ``system`` is ``use_sim_time`` of the system, ``own`` are the values of the node's entry.
    ``in_files()`` are all sections of the files. ``overridable`` are the parameters that override
    the QoS of its ports.
    """

    system: Map[str, Entry]
    files: ParameterFiles
    in_files: Callable[[], tuple[ParameterSection, ...]]
    own: Map[str, Entry]
    command_line: Map[str, Entry]
    overridable: frozenset[str]


@dataclass(frozen=True, slots=True)
class NodeParameters:
    """The parameters of a node, and what its program gets; see Node for the fields.

    ``qos_overrides`` are those of ``parameters`` that override the QoS of a port, by name.
    ``sections_from_files`` counts the sections that match the node or are passed to its program.
    """

    parameters: tuple[Parameter, ...]
    overridden_parameters: tuple[Parameter, ...]
    undeclared_parameters: tuple[Parameter, ...]
    sections: tuple[ParameterSection, ...]
    qos_overrides: Map[str, Parameter]
    unknown: tuple[UnknownKey, ...]
    sections_from_files: int


def sections_of(files: ParameterFiles) -> tuple[ParameterSection, ...]:
    """Return all sections of the files."""
    return tuple(
        ParameterSection(name, tuple(map(bare_parameter, values)))
        for name, values in files.joined()
    )


def node_parameters(
    declared: tuple[Parameter, ...],
    given: GivenValues,
    names: NodeNames,
    *,
    gets_undeclared: bool,
    is_program: bool,
) -> NodeParameters:
    """Return the parameters of a node with their values."""
    known = frozenset(item.name.value for item in declared) | given.overridable
    full_name = names.full_name
    in_files = given.files.given(full_name, None if gets_undeclared else known)
    values = {**given.system, **in_files, **given.own, **given.command_line}
    overrides = _qos_overrides(declared, values, given.overridable)
    others = [item for item in declared if item.name.value not in overrides]
    unusable = [] if gets_undeclared else list(filter(_overrides_qos, others))
    usable = others if gets_undeclared else [item for item in others if not _overrides_qos(item)]
    parameters = with_use_sim_time(tuple(usable), values)
    named = given.files.named(full_name)
    overridden = {name: entry for name, entry in named.items() if name in given.own}
    replaced = (item for item in parameters if item.name.value in overridden)
    valued = (*with_values(parameters, values), *overrides.values())
    passed: tuple[Parameter, ...] = ()
    if gets_undeclared:
        passed = tuple(map(bare_parameter, undeclared(valued, values)))
    own = ParameterSection(full_name, (*valued, *passed))
    sections: tuple[ParameterSection, ...] = (own,) if is_program else ()
    if is_program and gets_undeclared:
        sections = _all_sections(declared, given, own, are_kept=names.are_kept)
    unknown = () if gets_undeclared else unknown_parameters(valued, values)
    return NodeParameters(
        valued,
        with_values(replaced, overridden),
        passed,
        sections,
        overrides,
        (*(UnknownKey("parameters", item.name, ()) for item in unusable), *unknown),
        len(given.files.names_for(full_name)) + len(sections),
    )


def _overrides_qos(parameter: Parameter) -> bool:
    return parameter.name.value.startswith(PREFIX)


def _qos_overrides(
    declared: Iterable[Parameter], values: Map[str, Entry], overridable: frozenset[str]
) -> dict[str, Parameter]:
    """Return the parameters with values that override the QoS of a port, by name.

    They need no declaration, and a declaration counts as its default.
    """
    if not overridable:
        return {}
    given = (bare_parameter(values[name]) for name in values.keys() & overridable)
    found = {item.name.value: item for item in declared if item.name.value in overridable}
    found |= {item.name.value: item for item in given}
    return {name: override_parameter(item) for name, item in sorted(found.items())}


def _all_sections(
    declared: tuple[Parameter, ...], given: GivenValues, own: ParameterSection, *, are_kept: bool
) -> tuple[ParameterSection, ...]:
    """Return what a program gets that may have parameters that are not declared.

    It may create nodes of any name, so it gets all parameter files. What its entry declares and
    sets is for the node with its name; if the names of its nodes ``are_kept``, it is for all.
    """
    first = with_values(with_use_sim_time(declared if are_kept else (), given.system), given.system)
    last = own
    if are_kept:
        values = {**given.own, **given.command_line}
        valued = (item for item in with_values(declared, values) if item.name.value in values)
        passed = map(bare_parameter, undeclared(declared, values))
        last = ParameterSection(_LAST_FOR_ALL, (*valued, *passed))
    in_files = (section for section in given.in_files() if section.name != last.name)
    sections = (ParameterSection(_FIRST_FOR_ALL, first), *in_files, last)
    return tuple(section for section in sections if section.parameters)


def without_sections_of_others(nodes: list[Node]) -> tuple[Node, ...]:
    """Return the nodes; no program gets the parameters of a node of another entry.

    An external node may be one of the program.
    """
    started = [node for node in nodes if node.external is None]
    known = {name for node in started for name in (node.full_name, *node.inner_nodes)}

    def without_others(node: Node) -> Node:
        own = {node.full_name, *node.inner_nodes}
        sections = (x for x in node.parameter_sections if x.name in own or x.name not in known)
        return replace(node, parameter_sections=tuple(sections))

    return tuple(without_others(node) if node.parameter_sections else node for node in nodes)
