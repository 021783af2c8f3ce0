"""Values of parameter files that no node gets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Label, Severity, shown, suggestion, warning
from composer.model import UnmatchedParameters
from composer.names import namespace_problem, split_node_name
from composer.source import Located
from composer.spelling import is_typo

RULE = warning(
    code="RC246",
    name="unmatched-parameters",
    summary="A parameter file sets values for a node or parameter that does not exist.",
    why=(
        "Parameter files use the full ROS names of nodes, with the namespace and the prefixes "
        "of includes. Values under any other name are ignored, and the node keeps its "
        "defaults."
    ),
    bad="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {namespace: control, parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {ros__parameters: {speed: 2.0}}
""",
    good="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {namespace: control, parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/control/motor: {ros__parameters: {speed: 2.0}}
""",
)


#: A program may create a node with the name of the section, and gets its values.
_RULE_FOR_PROGRAMS = replace(RULE, severity=Severity.INFO)
_SHOWN = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the names of nodes, and the parameters below names with wildcards."""
    # With an invalid namespace, no name matches; another rule reports it.
    names = (context.system.namespace, *(node.full_name for node in context.system.nodes))
    is_named = namespace_problem(names[0]) is None and not any(map(is_unresolved, names))
    is_known = is_named and not context.is_partial
    has_programs = any(node.gets_undeclared and node.executable for node in context.system.nodes)
    of_programs: dict[str, list[Located[str]]] = {}
    for unmatched in context.system.unmatched_parameters if is_known else ():
        if unmatched.parameter is not None:
            name = unmatched.parameter.value
            yield Diagnostic(
                RULE,
                f"no node that '{unmatched.section}' matches has a parameter '{shown(name)}'",
                unmatched.parameter.span,
                hint=suggestion(name, unmatched.known),
            )
        elif has_programs and not _is_misspelled(unmatched):
            section = unmatched.section
            of_programs.setdefault(section.span.file.path, []).append(section)
        else:
            yield Diagnostic(
                RULE, _message(unmatched), unmatched.section.span, hint=_hint(unmatched)
            )
    for first, *others in of_programs.values():
        yield Diagnostic(
            _RULE_FOR_PROGRAMS,
            f"no node of this system is known to have the name '{shown(first.value)}'",
            first.span,
            tuple(Label(other.span, "nor this one") for other in others[:_SHOWN]),
            "if a program creates it, list it under 'nodes' of its executable",
        )


def _is_misspelled(unmatched: UnmatchedParameters) -> bool:
    """Return whether a section is most likely meant for a node, perhaps in another namespace."""
    name = unmatched.section.value
    last = split_node_name(name)[1]
    return unmatched.renamed is not None or any(
        is_typo(name, other) or split_node_name(other)[1] == last for other in unmatched.known
    )


def _message(unmatched: UnmatchedParameters) -> str:
    name = shown(unmatched.section.value)
    if unmatched.renamed is not None:
        return f"'{name}' does not match '{unmatched.renamed}', named with the prefix of an include"
    if "*" in name:
        return f"no node of this system matches '{name}'"
    return f"no node of this system is named '{name}'"


def _hint(unmatched: UnmatchedParameters) -> str | None:
    name = unmatched.section.value
    if unmatched.renamed is not None:
        own_name = unmatched.renamed.rpartition("/")[2]
        return f"write '{name.rpartition('/')[0]}/{own_name}'"
    if "*" in name:
        nodes = suggestion(name, unmatched.known, limit=3)
        meaning = "'*' stands for one part of a name, '**' for any number"
        return f"{meaning}; {nodes}" if nodes is not None else meaning
    return suggestion(name, unmatched.known)
