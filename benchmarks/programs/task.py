"""The task of a measured program and the topology of its nodes."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, fields

SHAPES = ("ring", "chain", "star", "hop", "timer", "service", "action", "pair")


@dataclass(frozen=True, slots=True)
class Task:
    """The size of the system, and what it does for how long.

    ``shape``: in a *ring*, one message circulates; in a *chain* and a *star*, the first node
    publishes at ``rate_hz`` and the others forward or receive the messages; in a *hop*, only the
    second node receives them; with *timer*, the first node has a timer; with *service* and
    *action*, the first node calls the second; a *pair* is a talker and a listener of ordinary rclpy
    node classes. All other nodes are idle. ``part`` is the index of the node of a ring that this
    process runs, if each node has a process. With ``split``, the processes belong to one system,
    and this one starts the others. ``seconds`` is ignored with ``until_stopped``: the task then
    runs until a line arrives on standard input.
    """

    executor: str
    shape: str
    nodes: int
    seconds: float
    rate_hz: float
    message: str
    part: int | None
    tracing: bool
    until_stopped: bool = False
    split: bool = False

    @property
    def is_timed(self) -> bool:
        """Whether the task has a fixed rate."""
        return self.shape in ("chain", "star", "hop", "timer", "pair")


@dataclass(frozen=True, slots=True)
class Place:
    """One node: its input and output topics, if any, and whether it forwards messages."""

    index: int
    input_topic: str | None
    output_topic: str | None
    relays: bool = True


def places(task: Task) -> Iterator[Place]:
    """Yield the nodes of this process."""
    for index in range(task.nodes):
        if task.part in (None, index):
            yield _place(task, index)


def _place(task: Task, index: int) -> Place:
    following = topic((index + 1) % task.nodes)
    match task.shape:
        case "chain":
            is_last = index == task.nodes - 1
            return Place(index, topic(index) if index else None, None if is_last else following)
        case "star":
            return Place(index, topic(1) if index else None, None if index else topic(1))
        case "hop":
            return Place(index, topic(index), following, relays=index != 1)
        case _:
            return Place(index, topic(index), following)


def topic(index: int) -> str:
    """Return the input topic of a node."""
    return f"/stage_{index}"


def task_from_arguments() -> Task:
    """Parse the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("executor")
    parser.add_argument("--shape", choices=SHAPES, required=True)
    parser.add_argument("--nodes", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--rate-hz", type=float, default=100.0)
    parser.add_argument("--message", default="String")
    parser.add_argument("--part", type=int)
    parser.add_argument("--no-tracing", dest="tracing", action="store_false")
    parser.add_argument("--until-stopped", action="store_true")
    parser.add_argument("--split", action="store_true")
    given = vars(parser.parse_args())
    return Task(**{field.name: given[field.name] for field in fields(Task)})
