"""A built-in node type that a folder without settings replaces."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, warning
from composer.node_types import replaced_built_in_type
from composer.project import SETTINGS_FILE, Project
from composer.source import shown_path

RULE = warning(
    code="RC214",
    name="replaced-node-type",
    summary="A nodes folder that no settings declare replaces a built-in node type.",
    why=(
        "Without settings, the nearest folder named nodes in any parent folder is used. It may "
        "have nothing to do with the system."
    ),
    bad="""\
# file: system.yaml
system: demo
nodes:
  echo: {type: relay}
# file: nodes/relay.yaml
node: relay
on_activate: {log: started}
""",
    good="""\
# file: system.yaml
system: demo
nodes:
  echo: {type: relay}
# file: nodes/relay.yaml
node: relay
on_activate: {log: started}
# file: composer.yaml
nodes: [nodes]
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the file of every node type, once."""
    seen = set()
    for node in context.system.nodes:
        if node.type_name is None or not node.type_files or node.type_files[0] in seen:
            continue
        path = node.type_files[0]
        seen.add(path)
        if replaced_built_in_type(path) is None:
            continue
        project = Project.at(path.parent)
        if not project.is_declared:
            yield Diagnostic(
                RULE,
                f"'{shown_path(path)}' replaces the built-in node type '{node.type_name}'",
                node.type_name.span,
                hint=f"rename it, or create {shown_path(project.root / SETTINGS_FILE)}, which"
                " declares the project",
            )
