"""Node types and their files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path, PurePath

from composer.analysis.context import Context, is_unresolved, location
from composer.diagnostics import Diagnostic, error, info, suggestion, warning
from composer.model import System
from composer.node_types import replaced_built_in_type
from composer.project import SETTINGS_FILE, Project
from composer.resolve.tree_values import is_opaque
from composer.source import Located, shown_path

UNKNOWN_NODE_TYPE = error(
    code="RC201",
    name="unknown-node-type",
    summary="A node's type is neither in the project's nodes/ folder nor built in.",
    why="Without the type, the ports and the behavior of the node are unknown.",
    bad="""\
system: stubs
nodes:
  planner:
    type: servce_stub
    variables: {service_type: std_srvs/srv/Trigger}
""",
    good="""\
system: stubs
nodes:
  planner:
    type: service_stub
    variables: {service_type: std_srvs/srv/Trigger}
""",
)


def check_unknown_node_type(context: Context) -> Iterator[Diagnostic]:
    """Check the type of every node that names one."""
    for node in context.system.nodes:
        name = node.type_name
        if name is None or node.type_found or is_unresolved(name.value):
            continue
        if context.node_types.find(name.value) is not None:
            continue  # the file exists but is invalid, which is reported elsewhere
        if context.node_types.find_outside_project(name.value) is not None:
            message = f"the file of node type '{name}' is a symbolic link out of the project"
            yield Diagnostic(
                UNKNOWN_NODE_TYPE, message, name.span, hint="copy the target into the project"
            )
            continue
        yield Diagnostic(
            UNKNOWN_NODE_TYPE,
            f"node '{node.name}' has type '{name}', which does not exist",
            name.span,
            hint=suggestion(name.value, context.node_types.names()),
        )


REPLACED_NODE_TYPE = warning(
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


def check_replaced_node_type(context: Context) -> Iterator[Diagnostic]:
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
                REPLACED_NODE_TYPE,
                f"'{shown_path(path)}' replaces the built-in node type '{node.type_name}'",
                node.type_name.span,
                hint=f"rename it, or create {shown_path(project.root / SETTINGS_FILE)}, which"
                " declares the project",
            )


NODE_TYPE_NAME = warning(
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


def check_node_type_name(context: Context) -> Iterator[Diagnostic]:
    """Compare the names of a node type, and of those of nodes, with the names of their files."""
    system = context.system
    if system.node_type:
        yield from _compare_with_file(system.name)
    names = (node.own_type_name for node in system.nodes)
    places = {location(name.span): name for name in names if name is not None}
    for name in places.values():
        yield from _compare_with_file(name)


def _compare_with_file(name: Located[str]) -> Iterator[Diagnostic]:
    file = PurePath(name.span.file.path)
    if file.suffix in _SUFFIXES and file.stem != name.value and not is_unresolved(name.value):
        yield Diagnostic(
            NODE_TYPE_NAME,
            f"node type '{name}' is in a file named '{file.name}'",
            name.span,
            hint=f"write 'node: {file.stem}', or rename the file to '{name}{file.suffix}'",
        )


UNUSED_NODE_TYPE = info(
    code="RC244",
    name="unused-node-type",
    summary="No validated system uses a validated node type.",
    why=(
        "The node type is left over, or a system uses another one instead. Reported only if "
        "systems and node types are validated together."
    ),
    bad="""\
nodes/planner.yaml
nodes/old_planner.yaml
systems/pipeline.yaml    # uses planner only
""",
    good="""\
nodes/planner.yaml
systems/pipeline.yaml    # uses planner
""",
)


def unused_node_types(loaded: Iterable[System]) -> Iterator[Diagnostic]:
    """Check all systems and node types of a run together."""
    node_types: list[System] = []
    systems: list[System] = []
    for system in loaded:
        (node_types if system.node_type else systems).append(system)
    used = {
        path.resolve() for system in systems for node in system.nodes for path in node.type_files
    }
    for node_type in node_types if systems else ():
        is_unused = Path(node_type.source.path).resolve() not in used
        if is_unused and not is_opaque(node_type.name.value):
            message = f"no system here uses node type '{node_type.name}'"
            yield Diagnostic(UNUSED_NODE_TYPE, message, node_type.name.span)
