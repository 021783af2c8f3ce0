"""The ring of nodes with ezmsg: a unit per node, in one process."""

from __future__ import annotations

import threading
import time
from collections.abc import AsyncIterator
from typing import Any

import ezmsg.core as ez

from benchmarks.programs.task import task_from_arguments
from benchmarks.programs.work import COUNTS, measure, print_result

TASK = task_from_arguments()


class Relay(ez.Unit):
    """Forwards messages."""

    INPUT = ez.InputStream(str)
    OUTPUT = ez.OutputStream(str)

    @ez.subscriber(INPUT)
    @ez.publisher(OUTPUT)
    async def on_input(self, message: str) -> AsyncIterator[Any]:
        COUNTS.delivered += 1
        yield self.OUTPUT, message


class Starter(ez.Unit):
    """Publishes the first message and measures."""

    OUTPUT = ez.OutputStream(str)

    @ez.publisher(OUTPUT)
    async def start(self) -> AsyncIterator[Any]:
        yield self.OUTPUT, "x" * 32
        threading.Thread(target=self.report, daemon=True).start()

    def report(self) -> None:
        print_result(measure(TASK, STARTED_S))


def main() -> None:
    units = {f"NODE_{index}": Relay() for index in range(TASK.nodes)}
    starter = Starter()
    nodes = list(units.values())
    following = [*nodes[1:], nodes[0]]
    edges = [(node.OUTPUT, after.INPUT) for node, after in zip(nodes, following, strict=True)]
    edges.append((starter.OUTPUT, nodes[0].INPUT))
    ez.run(**units, STARTER=starter, connections=edges)


STARTED_S = time.perf_counter()

if __name__ == "__main__":
    main()
