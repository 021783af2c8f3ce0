"""Build a scene from declared systems and their diagnostics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, Severity
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.graph.diagram import Cluster, Edge, EdgeKind, Mark, Problem, worst
from composer.graph.facts import (
    node_facts,
    port_facts,
    publishing_rates_hz,
    qos_label,
    transform_facts,
)
from composer.graph.scene import Scene, SceneNode, ScenePort, SceneTransform
from composer.model import (
    DEFAULT_EXECUTOR,
    Executor,
    ExecutorKind,
    ImplementationKind,
    Node,
    Port,
    System,
)
from composer.model.dependencies import dependency_edges
from composer.plan import bring_up
from composer.plan.drift.compare import states_after_bring_up
from composer.rules.analysis.context import location
from composer.rules.analysis.frames import kind_of, topic_of

#: The kinds of nodes that are noted on them.
_NOTED = (
    ImplementationKind.CLASS,
    ImplementationKind.EXECUTABLE,
    ImplementationKind.COMPONENT,
    ImplementationKind.EXTERNAL,
)
#: The groups of nodes that no executor runs.
_PROCESS = "process "
_CONTAINER = "container "
_OUTSIDE = {
    ImplementationKind.EXECUTABLE: "child processes",
    ImplementationKind.COMPONENT: "components",
    ImplementationKind.EXTERNAL: "external nodes",
}


@dataclass(frozen=True, slots=True)
class _BroughtUp:
    """The bring-up steps and final state of each node, by its key."""

    steps: dict[str, str]
    states: dict[str, str]

    @classmethod
    def of(cls, system: System) -> _BroughtUp:
        steps: dict[str, list[str]] = {}
        for step in bring_up(system).steps:
            steps.setdefault(step.node, []).append(f"#{step.number} {step.transition}")
        labels = {name: ", ".join(texts) for name, texts in steps.items()}
        return cls(labels, states_after_bring_up(system))


def scene_of(systems: Sequence[System], diagnostics: Iterable[Diagnostic] = ()) -> Scene:
    """Return the nodes of one or several systems as one scene. What has diagnostics is marked.

    If several nodes have the same full name, the first is drawn and marked as wrong.
    """
    problems = _Problems(diagnostics)
    several = len(systems) > 1
    nodes: dict[str, SceneNode] = {}
    for system in systems:
        brought_up = _BroughtUp.of(system)
        for node in system.nodes:
            scene_node = _scene_node(node, system, brought_up, problems, several)
            first = nodes.get(scene_node.full_name)
            nodes[scene_node.full_name] = scene_node if first is None else _with_duplicate(first)
    return Scene(
        title=" + ".join(system.name.value for system in systems),
        nodes=tuple(nodes.values()),
        waits=tuple(wait for system in systems for wait in _waits(system)),
        transforms=tuple(
            transform
            for system in systems
            for node in system.nodes
            for transform in _transforms(node, problems)
        ),
        executors=tuple(
            dict.fromkeys(group for system in systems for group in _groups(system, several))
        ),
    )


def _scene_node(
    node: Node, system: System, brought_up: _BroughtUp, problems: _Problems, several: bool
) -> SceneNode:
    rates_hz = publishing_rates_hz(node)
    return SceneNode(
        name=node.ros_name.value,
        full_name=node.full_name,
        namespace=node.namespace.value,
        note=_note(node, system, several),
        state=brought_up.states[node.name.value],
        steps=brought_up.steps.get(node.name.value, ""),
        executor=_executor_key(system, _executor_name(node, system)),
        ports=tuple(
            _scene_port(port, rates_hz.get(port.name.value), problems) for port in node.ports
        ),
        details=node_facts(node, rates_hz),
        problem=problems.about(_node_spans(node)),
    )


def _with_duplicate(scene_node: SceneNode) -> SceneNode:
    twice = Problem(f"two nodes are called '{scene_node.full_name}'")
    return replace(scene_node, problem=worst((scene_node.problem, twice)))


def _note(node: Node, system: System, several: bool) -> str:
    """Return the note of a node: its type if it differs from its name, its kind, its system.

    A program that creates further nodes is noted with their number.
    """
    type_name = node.type_name.value if node.type_name is not None else ""
    labels = type_name if type_name != node.ros_name.value else ""
    kind = node.implementation.value if node.implementation in _NOTED else ""
    others = len(node.inner_nodes)
    more = f"with {others} more node{'s' * (others > 1)}" if others else ""
    return " · ".join(filter(None, (labels, kind, more, system.name.value if several else "")))


def _scene_port(port: Port, rate_hz: float | None, problems: _Problems) -> ScenePort:
    return ScenePort(
        kind=port.kind,
        name=port.name.value,
        channel=port.full_name,
        interface=port.interface.value,
        qos=qos_label(port.qos.profile) if port.qos.explicit else "",
        rate_hz=rate_hz,
        details=port_facts(port, rate_hz),
        problem=problems.about(_port_spans(port)),
    )


def _transforms(node: Node, problems: _Problems) -> Iterator[SceneTransform]:
    for item in node.transforms.broadcasts if node.transforms is not None else ():
        yield SceneTransform(
            topic=topic_of(node, item),
            parent=item.parent.value,
            child=item.child.value,
            kind=kind_of(item),
            node=node.full_name,
            details=transform_facts(item),
            problem=problems.about((item.child.span, item.parent.span)),
        )


def _waits(system: System) -> Iterator[Edge]:
    keys = {node.name.value: f"node:{node.full_name}" for node in system.nodes}
    states = {
        (node.name.value, dependency.node.value): dependency.state.value
        for node in system.nodes
        for dependency in node.depends_on
    }
    for edge in dependency_edges(system):
        if edge.implied and (edge.node, edge.on) in states:
            continue  # declared already
        reason = f"serves {edge.serves}" if edge.implied else f"once {states[edge.node, edge.on]}"
        source, target = keys[edge.on], keys[edge.node]
        kind = EdgeKind.IMPLIED if edge.implied else EdgeKind.DEPENDENCY
        yield Edge(f"{source} -> {target} {reason}", source, target, kind, (reason,))


def _groups(system: System, several: bool) -> Iterator[Cluster]:
    declared = {executor.name.value: executor for executor in system.executors}
    hosts = {
        f"{_PROCESS}{process.name}": f" on {process.host}"
        for process in system.processes
        if process.host is not None
    }
    prefix = f"{system.name.value} · " if several else ""
    around: dict[str, str] = {}
    for node in system.nodes:
        name = _executor_name(node, system)
        if name.startswith(_CONTAINER) and node.process is not None:
            around[name] = f"{_PROCESS}{node.process.value}"
    names = (_executor_name(node, system) for node in system.nodes)
    for name in dict.fromkeys([*declared, *around.values(), *names]):
        kind = _kind(declared.get(name))
        has_kind = name not in _OUTSIDE.values() and not name.startswith((_PROCESS, _CONTAINER))
        label = f"{prefix}{name}: {kind}" if has_kind else f"{prefix}{name}{hosts.get(name, '')}"
        parent = _executor_key(system, around[name]) if name in around else ""
        yield Cluster(_executor_key(system, name), label, parent)


def _executor_name(node: Node, system: System) -> str:
    container = node.container.value if node.container is not None else node.name.value
    if container in system.computed(_containers):
        return f"{_CONTAINER}{container}"
    if node.process is not None:
        return f"{_PROCESS}{node.process.value}"
    if not node.implementation.in_process:
        return _OUTSIDE[node.implementation]
    return node.executor.value if node.executor is not None else DEFAULT_EXECUTOR


def _containers(system: System) -> frozenset[str]:
    """Return the nodes that load components."""
    return frozenset(
        node.container.value
        for node in system.nodes
        if node.container is not None and system.node(node.container.value) is not None
    )


def _executor_key(system: System, executor: str) -> str:
    return f"executor:{system.name.value}.{executor}"


def _kind(executor: Executor | None) -> str:
    if executor is None:
        return ExecutorKind.EVENTS.value
    if executor.kind is ExecutorKind.MULTI_THREADED:
        return f"{executor.kind}, {executor.threads} threads"
    return executor.kind.value


class _Problems:
    """Errors and warnings by location, as marks of what they are about."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self._by_place: dict[tuple[str, int, int], Problem] = {}
        for diagnostic in diagnostics:
            if diagnostic.severity is Severity.INFO:
                continue
            mark = Mark.WRONG if diagnostic.severity is Severity.ERROR else Mark.DOUBTFUL
            problem = Problem(f"{diagnostic.rule.code} {diagnostic.message}", mark)
            for span in (diagnostic.primary, *(label.span for label in diagnostic.related)):
                place = location(span)
                self._by_place[place] = worst((self._by_place.get(place), problem)) or problem

    def about(self, spans: Iterable[Span]) -> Problem | None:
        """Return the worst diagnostic at one of the spans of a thing, if there is one."""
        return worst(self._by_place.get(location(span)) for span in spans)


def _port_spans(port: Port) -> Iterator[Span]:
    yield port.span
    yield port.name.span
    yield port.interface.span
    yield port.ros_name.span
    yield port.qos.span
    for _, span in port.qos.policy_spans:
        yield span


def _node_spans(node: Node) -> Iterator[Span]:
    yield node.span
    yield node.name.span
    yield node.namespace.span
    if node.type_name is not None:
        yield node.type_name.span
    if node.behavior is not None:
        yield node.behavior.text.span
    if node.hosted_class is not None:
        yield node.hosted_class.reference.text.span
    if node.executable is not None:
        yield from (key.span for key in node.executable.given)
    if node.outside is not None:
        yield node.outside.span
    if node.executor is not None:
        yield node.executor.span
    for dependency in node.depends_on:
        yield dependency.node.span
    for parameter in node.parameters:
        yield parameter.span
        if parameter.value is not None:
            yield parameter.value.span
