"""A node type with another name than its file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath

from composer.analysis.context import Context, is_unresolved, location
from composer.diagnostics import Diagnostic, warning
from composer.source import Located

RULE = warning(
    code="RC215",
    name="node-type-name",
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


_SUFFIXES = frozenset({".yaml", ".yml"})


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the names of a node type, and of those of nodes, with the names of their files."""
    system = context.system
    if system.node_type:
        yield from _named(system.name)
    names = (node.own_type_name for node in system.nodes)
    places = {location(name.span): name for name in names if name is not None}
    for name in places.values():
        yield from _named(name)


def _named(name: Located[str]) -> Iterator[Diagnostic]:
    file = PurePath(name.span.file.path)
    if file.suffix in _SUFFIXES and file.stem != name.value and not is_unresolved(name.value):
        yield Diagnostic(
            RULE,
            f"node type '{name}' is in a file named '{file.name}'",
            name.span,
            hint=f"write 'node: {file.stem}', or rename the file to '{name}{file.suffix}'",
        )
