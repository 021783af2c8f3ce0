"""The parameters of a node of a system, and what the program of an executable gets of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Map
from dataclasses import replace

from composer.base.fast_dataclass import dataclass
from composer.language.tree import Entry
from composer.model import Node, Parameter, ParameterSection, UnknownKey
from composer.model.resolve.declarations.parameters import (
    bare_parameter,
    undeclared,
    unknown_parameters,
    with_use_sim_time,
    with_values,
)
from composer.model.resolve.nodes.node_settings import NodeNames
from composer.model.resolve.parameter_files import ParameterFiles

#: Names that match every node. rcl joins sections of the same name, at the place of the first.
_FIRST_FOR_ALL, _LAST_FOR_ALL = "/**/*", "/*/**"


@dataclass(frozen=True, slots=True)
class GivenValues:
    """The values for a node by parameter. A later field takes precedence.

    ``system`` is ``use_sim_time`` of the system, ``own`` are the values of the node's entry.
    ``in_files()`` are all sections of the files.
    """

    system: Map[str, Entry]
    files: ParameterFiles
    in_files: Callable[[], tuple[ParameterSection, ...]]
    own: Map[str, Entry]
    command_line: Map[str, Entry]


@dataclass(frozen=True, slots=True)
class NodeParameters:
    """The parameters of a node, and what its program gets; see Node for the fields."""

    parameters: tuple[Parameter, ...]
    overridden_parameters: tuple[Parameter, ...]
    undeclared_parameters: tuple[Parameter, ...]
    sections: tuple[ParameterSection, ...]
    unknown: tuple[UnknownKey, ...]


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
    known = None if gets_undeclared else frozenset(item.name.value for item in declared)
    in_files = given.files.given(names.full_name, known)
    values = {**given.system, **in_files, **given.own, **given.command_line}
    parameters = with_use_sim_time(declared, values)
    named = given.files.named(names.full_name)
    overridden = {name: entry for name, entry in named.items() if name in given.own}
    others = (item for item in parameters if item.name.value in overridden)
    valued = with_values(parameters, values)
    passed: tuple[Parameter, ...] = ()
    if gets_undeclared:
        passed = tuple(map(bare_parameter, undeclared(parameters, values)))
    own = ParameterSection(names.full_name, (*valued, *passed))
    sections: tuple[ParameterSection, ...] = (own,) if is_program else ()
    if is_program and gets_undeclared:
        sections = _all_sections(declared, given, own, are_kept=names.are_kept)
    return NodeParameters(
        valued,
        with_values(others, overridden),
        passed,
        sections,
        () if gets_undeclared else unknown_parameters(parameters, values),
    )


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


def without_sections_of_others(nodes: Sequence[Node]) -> tuple[Node, ...]:
    """Return the nodes; no program gets the parameters of a node of another entry.

    An external node may be one of the program.
    """
    started = (node for node in nodes if node.external is None)
    known = {name for node in started for name in (node.full_name, *node.inner_nodes)}

    def without_others(node: Node) -> Node:
        others = known - {node.full_name, *node.inner_nodes}
        sections = (item for item in node.parameter_sections if item.name not in others)
        return replace(node, parameter_sections=tuple(sections))

    return tuple(without_others(node) if node.parameter_sections else node for node in nodes)
