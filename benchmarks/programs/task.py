"""What a measured program is to do, and how its nodes are joined: the same for every way."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, fields

SHAPES = ("ring", "chain", "star", "hop", "timer", "service", "action")


@dataclass(frozen=True, slots=True)
class Task:
    """How large the system is, and what happens in it for how long.

    ``shape``: in a *ring* one message goes round and round; in a *chain* and a *star* the first
    node sends at ``rate_hz``, and the others pass it on or hear it; in a *hop* the second node
    alone hears it; a *timer* ticks in the first node; the first node asks the second by *service*
    or *action*. What has no part in it is there and idle. ``part`` is the index of
    the one node of a ring that this process has, when the others are other processes. ``seconds``
    do not count when it is to last until a line comes on standard input.
    """

    executor: str
    shape: str
    nodes: int
    seconds: float
    rate_hz: float
    message: str
    part: int | None
    tracing: bool
    until_told: bool = False

    @property
    def is_timed(self) -> bool:
        """Whether something happens at a rate, and not as fast as it can."""
        return self.shape in ("chain", "star", "hop", "timer")


@dataclass(frozen=True, slots=True)
class Place:
    """One node: what it hears and what it sends to, None for nothing, and whether it passes on."""

    index: int
    hears: str | None
    sends: str | None
    relays: bool = True


def places(task: Task) -> Iterator[Place]:
    """Yield the nodes that this process is to run."""
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
    """Return the topic that a node listens to."""
    return f"/stage_{index}"


def task_from_arguments() -> Task:
    """Read the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("executor")
    parser.add_argument("--shape", choices=SHAPES, required=True)
    parser.add_argument("--nodes", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--rate-hz", type=float, default=100.0)
    parser.add_argument("--message", default="String")
    parser.add_argument("--part", type=int)
    parser.add_argument("--no-tracing", dest="tracing", action="store_false")
    parser.add_argument("--until-told", action="store_true")
    given = vars(parser.parse_args())
    return Task(**{field.name: given[field.name] for field in fields(Task)})
