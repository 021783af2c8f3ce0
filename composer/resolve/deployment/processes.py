"""Read the processes of a system."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from composer.model import Process
from composer.resolve.tree_values import entries, environment, integer, key, number, text, texts
from composer.source import Located
from composer.tree import Entry, Sequence, Tree
from composer.tree import Mapping as MappingTree


def read_processes(tree: Tree | None) -> tuple[Process, ...]:
    """Return the processes."""
    return tuple(_process(entry) for entry in entries(tree))


def processes_of_nodes(processes: Iterable[Process]) -> Mapping[str, Located[str]]:
    """Return the process of each node that a process names; the first one that does."""
    found: dict[str, Located[str]] = {}
    for process in processes:
        for node in process.nodes:
            found.setdefault(node.value, process.name)
    return found


def _process(entry: Entry) -> Process:
    tree = entry.value if isinstance(entry.value, MappingTree) else MappingTree((), entry.key.span)
    cpus = tree.get("cpus")
    numbers = map(integer, cpus.items if isinstance(cpus, Sequence) else ())
    priority = integer(tree.get("priority"))
    return Process(
        name=key(entry),
        span=entry.key.span,
        nodes=texts(tree.get("nodes")) if tree.get("nodes") is not None else (),
        cpus=tuple(number.value for number in numbers if number is not None),
        priority=None if priority is None else priority.value,
        environment=environment(tree.get("environment")),
        memory_mb=number(tree.get("memory_mb")),
        host=text(tree.get("host")),
    )
