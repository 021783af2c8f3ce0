"""A parameter that is probably a misspelled one of a base type."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath

from composer.analysis.context import Context
from composer.analysis.messages.expressions import expression_sites
from composer.analysis.python_nodes import behaviors
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Node, Parameter
from composer.spelling import is_typo

RULE = warning(
    code="RC216",
    name="similar-parameter",
    summary="A derived node type declares an unused parameter, named like one of its base.",
    why=(
        "A value in 'parameters' sets a parameter of the base type, or declares a new one. "
        "If the name is misspelled, the real parameter silently keeps its default."
    ),
    bad="""\
# file: nodes/fast.yaml
node: fast
extends: base
parameters: {sped: 2.0}
# file: nodes/base.yaml
node: base
parameters: {speed: 1.0}
on_activate: {log: "at {parameters.speed} m/s"}
""",
    good="""\
# file: nodes/fast.yaml
node: fast
extends: base
parameters: {speed: 2.0}
# file: nodes/base.yaml
node: base
parameters: {speed: 1.0}
on_activate: {log: "at {parameters.speed} m/s"}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the unused parameters of derived types with those of their base types."""
    nodes = context.system.nodes
    # What uses the parameters of a program is unknown.
    derived = [node for node in nodes if len(_files(node)) > 1 and not node.gets_undeclared]
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
                yield from _compare(node, parameter)


def _files(node: Node) -> set[str]:
    return {parameter.name.span.file.path for parameter in node.parameters}


def _compare(node: Node, parameter: Parameter) -> Iterator[Diagnostic]:
    name, file = parameter.name.value, parameter.name.span.file.path
    for other in node.parameters:
        meant = other.name.value
        if other.name.span.file.path == file or other.type.value != parameter.type.value:
            continue
        if is_typo(name, meant):
            yield Diagnostic(
                RULE,
                f"'{name}' is a new parameter that nothing uses",
                parameter.name.span,
                (Label(other.name.span, "a parameter of the base type"),),
                f"did you mean '{meant}'?",
            )
            return
