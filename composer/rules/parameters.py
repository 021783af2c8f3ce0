"""Names of parameters: unknown, missing, or similar to others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import PurePath

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Severity,
    Subject,
    error,
    nearest,
    shown,
    suggestion,
    warning,
)
from composer.base.source import Located, Span
from composer.base.spelling import is_typo, misspelled
from composer.model import ChannelKind, Node, Parameter, PortKind, UnmatchedParameters
from composer.model.names import namespace_problem, split_node_name
from composer.model.qos_overrides import PREFIX as QOS_OVERRIDES
from composer.model.qos_overrides import overridable_policies
from composer.model.resolve.parameter_files import PARAMETER_FILES
from composer.rules.analysis.context import Context, behaviors, is_unresolved, part_of_path
from composer.rules.analysis.expressions import expression_sites
from composer.rules.analysis.subjects import earlier_errors

UNKNOWN_PARAMETER = error("RC206", "unknown-parameter")
SIMILAR_PARAMETER = warning("RC216", "similar-parameter")
UNMATCHED_PARAMETERS = warning("RC246", "unmatched-parameters")
MISSING_PARAMETER = error("RC424", "missing-parameter")

_UNKNOWN_PARAMETER_IF_PASSED_ON = replace(UNKNOWN_PARAMETER, severity=Severity.INFO)
#: rclpy and rclcpp declare parameters without a value; reading them may fail.
_MISSING_IF_PASSED_ON = replace(MISSING_PARAMETER, severity=Severity.WARNING)
_SEVERAL = 2
_SHOWN_VALUES = 3
#: A program may create a node with the name of the section, and gets its values.
_UNMATCHED_FOR_PROGRAMS = replace(UNMATCHED_PARAMETERS, severity=Severity.INFO)
_SHOWN_SECTIONS = 3


def check_unknown_parameter(context: Context) -> Iterator[Diagnostic]:
    """Check the values that instances set and the parameters that expressions read."""
    first = {
        parameter.name.value: node
        for node in reversed(context.system.nodes)
        for parameter in node.parameters
    }
    for node in context.system.nodes:
        moved = _of_another_node(node, first)
        yield from _unknown_values(node) if moved is None else (moved,)
        yield from _misspelled(node)
    errors = context.once(earlier_errors)
    known = {
        node.name.value: [parameter.name.value for parameter in node.parameters]
        for node in context.system.nodes
    }
    names = {node: frozenset(declared) for node, declared in known.items()}
    for node_name, name, span in _parameter_uses(context, names):
        if name not in names[node_name] and not errors.may_declare(node_name, "parameters"):
            yield Diagnostic(
                UNKNOWN_PARAMETER,
                f"the node does not declare parameter '{name}'",
                span,
                hint=suggestion(name, known[node_name]),
            )


def _misspelled(node: Node) -> Iterator[Diagnostic]:
    """Yield the parameters that are passed on, but named like one that is declared."""
    declared = tuple(parameter.name.value for parameter in node.parameters)
    for undeclared in node.undeclared_parameters:
        name = undeclared.name
        meant = misspelled(name.value, declared)
        if meant is not None:
            message = f"node '{node.name}' does not declare parameter '{name}'"
            hint = f"did you mean '{meant}'?"
            yield Diagnostic(_UNKNOWN_PARAMETER_IF_PASSED_ON, message, name.span, hint=hint)


def _of_another_node(node: Node, first: Mapping[str, Node]) -> Diagnostic | None:
    """Return one report of several values that are all for the parameters of another node.

    ``first`` are the first nodes with parameters of these names.
    """
    unknown = [item for item in node.unknown if item.section == "parameters"]
    names = {item.name.value for item in unknown}
    if len(names) < _SEVERAL:
        return None
    other = first.get(unknown[0].name.value)
    if other is None or not all(other.parameter(name) for name in names):
        return None
    listed = " and ".join(f"'{item.name}'" for item in unknown[:_SEVERAL])
    labels = (Label(item.name.span, "nor this one") for item in unknown[1 : 1 + _SHOWN_VALUES])
    return Diagnostic(
        UNKNOWN_PARAMETER,
        f"node '{node.name}' has no parameters {listed}",
        unknown[0].name.span,
        tuple(labels),
        f"node '{other.name}' has them",
        relies_on=(("same node", node.name.value),),
    )


def _unknown_values(node: Node) -> Iterator[Diagnostic]:
    """Yield the unknown names, and each parameter once that gets a map of names."""
    types = {item.name.value: item.type.value for item in node.parameters}
    maps: set[str] = set()
    for unknown in node.unknown:
        name = unknown.name.value
        first, dot, _ = name.partition(".")
        is_map = first in types and not any(other.startswith(f"{first}.") for other in types)
        if unknown.section != "parameters" or first in maps:
            continue
        if name.startswith(QOS_OVERRIDES):
            if not any(is_unresolved(port.full_name) for port in node.ports):
                yield _unknown_override(node, unknown.name)
            continue
        if dot and is_map:
            maps.add(first)
            message = f"parameter '{first}' of node '{node.name}' is a {types[first]}, not a map"
            yield Diagnostic(UNKNOWN_PARAMETER, message, unknown.name.span)
        else:
            yield Diagnostic(
                UNKNOWN_PARAMETER,
                f"node '{node.name}' has no parameter '{name}'",
                unknown.name.span,
                hint=suggestion(name, unknown.known),
                relies_on=(("same node", node.name.value),),
            )


def _unknown_override(node: Node, name: Located[str]) -> Diagnostic:
    """Report a QoS override with the first part of its name that is wrong."""
    topic, *rest = name.value.removeprefix(QOS_OVERRIDES).split(".")
    kind, policy = (*rest, "", "")[:2]
    ports = [port for port in node.visible_ports if port.kind.channel is ChannelKind.TOPIC]
    kinds = [port.kind for port in ports if port.full_name == topic]
    if not kinds:
        topics = [port.full_name for port in ports if port.kind == kind]
        problem = f"node '{node.name}' has no topic '{topic}'"
        hint = suggestion(topic, topics or [port.full_name for port in ports])
    elif kind not in kinds:
        problem = f"node '{node.name}' has no {kind or 'port'} on '{topic}'"
        hint = suggestion(kind, kinds)
    else:
        problem = f"the policy '{policy}' of a {kind} cannot be overridden"
        hint = suggestion(policy, overridable_policies(PortKind(kind)))
    causes = (("same node", node.name.value),)
    return Diagnostic(UNKNOWN_PARAMETER, problem, name.span, hint=hint, relies_on=causes)


def _parameter_uses(
    context: Context, known: Mapping[str, frozenset[str]]
) -> Iterator[tuple[str, str, Span]]:
    for site in context.once(expression_sites):
        for path in site.expression.paths:
            if path.root == "parameters" and len(path.parts) > 1:
                span = part_of_path(site.span, site.expression, path, 1)
                node_name = site.node.name.value
                yield node_name, path.key(known[node_name]) or str(path.parts[1]), span


def check_missing_parameter(context: Context) -> Iterator[Diagnostic]:
    """Check for parameters without a value. A node type alone does not need them."""
    if context.system.node_type:
        return
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        is_named = not is_unresolved(node.name.value)
        if not is_named or errors.may_declare(node.name.value, "parameters"):
            continue
        unknown = [item.name.value for item in node.unknown if item.section == "parameters"]
        for parameter in node.parameters:
            if parameter.value is None:
                if nearest(parameter.name.value, unknown) is not None:
                    continue  # it is probably set, with a misspelled name
                yield Diagnostic(
                    _MISSING_IF_PASSED_ON if node.gets_undeclared else MISSING_PARAMETER,
                    f"node '{node.name}' needs a value for parameter '{parameter.name}'",
                    node.name.span,
                    (Label(parameter.name.span, "declared without a default"),),
                    f"add 'parameters: {{{parameter.name}: ...}}' to the node",
                    relies_on=(PARAMETER_FILES,),
                )


def check_similar_parameter(context: Context) -> Iterator[Diagnostic]:
    """Compare the unused parameters of derived types and of their base types."""
    nodes = context.system.nodes
    # What uses the parameters of a program is unknown.
    derived = [
        node
        for node in nodes
        if len({parameter.name.span.file.path for parameter in node.parameters}) > 1
        and not node.gets_undeclared
    ]
    if not derived:
        return
    used = {
        (site.node.name.value, str(path.parts[1]))
        for site in context.once(expression_sites)
        for path in site.expression.paths
        if path.root == "parameters" and len(path.parts) > 1
    }
    code = {
        node.name.value: "\n".join(module.source.text for module in source.own_modules)
        for node, source in behaviors(context)
    }
    for node in derived:
        # The file of a derived type comes before those of its base types.
        own = node.type_files[0].name if node.type_files else context.system.source.path
        text = code.get(node.name.value, "")
        for parameter in node.parameters:
            name = parameter.name.value
            is_own = PurePath(parameter.name.span.file.path).name == PurePath(own).name
            if is_own and (node.name.value, name) not in used and name not in text:
                yield from _similar(node, parameter)


def _similar(node: Node, parameter: Parameter) -> Iterator[Diagnostic]:
    name, file = parameter.name.value, parameter.name.span.file.path
    for other in node.parameters:
        meant = other.name.value
        if other.name.span.file.path == file or other.type.value != parameter.type.value:
            continue
        if is_typo(name, meant):
            yield Diagnostic(
                SIMILAR_PARAMETER,
                f"'{name}' is a new parameter that nothing uses",
                parameter.name.span,
                (Label(other.name.span, "a parameter of the base type"),),
                f"did you mean '{meant}'?",
            )
            return


def check_unmatched_parameters(context: Context) -> Iterator[Diagnostic]:
    """Check the names of nodes, and the parameters below names with wildcards."""
    # With an invalid namespace, no name matches; another rule reports it.
    names = (context.system.namespace, *(node.full_name for node in context.system.nodes))
    is_named = namespace_problem(names[0]) is None and not any(map(is_unresolved, names))
    is_known = is_named and not context.is_partial
    has_programs = any(node.gets_undeclared and node.executable for node in context.system.nodes)
    of_programs: dict[str, list[Located[str]]] = {}
    for unmatched in context.system.unmatched_parameters if is_known else ():
        node_name = split_node_name(unmatched.section.value)[1]
        if context.system.left_out_entry("nodes", node_name) is not None:
            continue
        if unmatched.parameter is not None:
            name = unmatched.parameter.value
            yield Diagnostic(
                UNMATCHED_PARAMETERS,
                f"no node that '{unmatched.section}' matches has a parameter '{shown(name)}'",
                unmatched.parameter.span,
                hint=suggestion(name, unmatched.known),
            )
        elif has_programs and not _is_misspelled_section(unmatched):
            section = unmatched.section
            of_programs.setdefault(section.span.file.path, []).append(section)
        else:
            yield Diagnostic(
                UNMATCHED_PARAMETERS,
                _section_message(unmatched),
                unmatched.section.span,
                hint=_section_hint(unmatched),
                relies_on=_node_of_section(unmatched.section.value),
            )
    for first, *others in of_programs.values():
        yield Diagnostic(
            _UNMATCHED_FOR_PROGRAMS,
            f"no node of this system is known to have the name '{shown(first.value)}'",
            first.span,
            tuple(Label(other.span, "nor this one") for other in others[:_SHOWN_SECTIONS]),
            "if a program creates it, list it under 'nodes' of its executable",
        )


def _node_of_section(section: str) -> tuple[Subject, ...]:
    name = split_node_name(section)[1]
    return (("section", name), ("node", name))


def _is_misspelled_section(unmatched: UnmatchedParameters) -> bool:
    """Return whether a section is most likely meant for a node, perhaps in another namespace."""
    name = unmatched.section.value
    last = split_node_name(name)[1]
    return unmatched.renamed is not None or any(
        is_typo(name, other) or split_node_name(other)[1] == last for other in unmatched.known
    )


def _section_message(unmatched: UnmatchedParameters) -> str:
    name = shown(unmatched.section.value)
    if unmatched.renamed is not None:
        return f"'{name}' does not match '{unmatched.renamed}', named with the prefix of an include"
    if "*" in name:
        return f"no node of this system matches '{name}'"
    return f"no node of this system is named '{name}'"


def _section_hint(unmatched: UnmatchedParameters) -> str | None:
    name = unmatched.section.value
    if unmatched.renamed is not None:
        own_name = unmatched.renamed.rpartition("/")[2]
        return f"write '{name.rpartition('/')[0]}/{own_name}'"
    if "*" in name:
        nodes = suggestion(name, unmatched.known, limit=3)
        meaning = "'*' stands for one part of a name, '**' for any number"
        return f"{meaning}; {nodes}" if nodes is not None else meaning
    return suggestion(name, unmatched.known)
