"""A node type with another name than its file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC215",
        name="node-type-name",
        severity=Severity.WARNING,
        summary="A node type has another name than its file.",
        why=(
            "Systems refer to a node type by the name of its file, so 'node' is never found "
            "under its own name."
        ),
        bad="""\
# file: nodes/talker.yaml
node: taker
publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
timers: {tick: {period_ms: 1000, publish: {chatter: {data: hello}}}}
""",
        good="""\
# file: nodes/talker.yaml
node: talker
publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
timers: {tick: {period_ms: 1000, publish: {chatter: {data: hello}}}}
""",
    )
)


_SUFFIXES = frozenset({".yaml", ".yml"})


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the name of a node type with that of its file."""
    system = context.system
    file = PurePath(system.source.path)
    if not system.node_type or file.suffix not in _SUFFIXES or is_unresolved(system.name.value):
        return
    if system.name.value != file.stem:
        yield Diagnostic(
            RULE,
            f"node type '{system.name}' is in a file named '{file.name}'",
            system.name.span,
            hint=f"write 'node: {file.stem}', or rename the file to '{system.name}{file.suffix}'",
        )
