"""A namespace that is not valid in ROS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.formatting import safe_name
from composer.diagnostics import Diagnostic, error
from composer.model import System
from composer.names import join, namespace_problem, node_name_problem
from composer.source import Located

RULE = error(
    code="RC222",
    name="invalid-namespace",
    summary="A namespace is not valid in ROS.",
    why=(
        "The parts of a namespace consist of letters, digits and underscores, do not start "
        "with a digit, and are separated by single slashes (rmw_validate_namespace). The name "
        "of a system is such a part: its manager node is /<system>/manager."
    ),
    bad="""\
system: names
nodes:
  camera: {namespace: robot 1, on_activate: {log: started}}
""",
    good="""\
system: names
nodes:
  camera: {namespace: robot_1, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the namespaces of the system and its nodes; a shared one is reported once."""
    yield from _name_of_system(context.system)
    system = context.system
    namespaces = [node.namespace for node in system.nodes]
    if system.namespace_span is not None:
        namespaces.append(Located(system.namespace, system.namespace_span))
    found = [namespace for namespace in namespaces if _is_invalid(namespace.value)]
    invalid = {namespace.value for namespace in found}
    for namespace in found:
        if not any(outer in invalid for outer in _outer(namespace.value)):
            problem = namespace_problem(namespace.value)
            yield Diagnostic(RULE, f"namespace '{namespace}' {problem}", namespace.span)


def _is_invalid(namespace: str) -> bool:
    return namespace_problem(namespace) is not None and not is_unresolved(namespace)


def _outer(namespace: str) -> Iterator[str]:
    """Yield the namespaces around a namespace."""
    while namespace := namespace.rpartition("/")[0]:
        yield namespace


def _name_of_system(system: System) -> Iterator[Diagnostic]:
    name = system.name
    if system.node_type or is_unresolved(name.value):
        return
    problem = node_name_problem(name.value)
    if problem is None and namespace_problem(system.namespace) is None:
        problem = namespace_problem(join(system.namespace, name.value))
    if problem is not None:
        valid = safe_name(name.value)
        hint = f"rename it to '{valid}'" if valid != name.value else None
        yield Diagnostic(RULE, f"system name '{name}' {problem}", name.span, hint=hint)
