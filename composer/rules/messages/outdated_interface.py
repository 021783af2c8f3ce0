"""An interface whose definition has changed since it was built."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error
from composer.interfaces.building import how_to_build

RULE = error(
    code="RC307",
    name="outdated-interface",
    summary="An interface of the project has changed since its package was built.",
    why=(
        "Nodes use the installed package. With other fields or types, messages cannot be "
        "built, and nodes of other processes do not receive them."
    ),
    bad="nano interfaces/arm_interfaces/msg/Grip.msg  # and run, without building it again",
    good="nano interfaces/arm_interfaces/msg/Grip.msg && colcon build",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the project's definitions of all port types with the installed ones, if any."""
    reported: set[str] = set()
    for node in context.system.nodes:
        for port in node.ports:
            name = port.interface
            if is_unresolved(name.value):
                continue
            outdated = context.interfaces.outdated(name.value)
            if outdated is None or outdated in reported:
                continue
            reported.add(outdated)
            package = outdated.partition("/")[0]
            yield Diagnostic(
                RULE,
                f"'{outdated}' has changed since the package '{package}' was built",
                name.span,
                hint=how_to_build(package, context.interfaces.source_folder(outdated)),
            )
