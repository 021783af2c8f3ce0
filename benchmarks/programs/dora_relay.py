"""A node of the ring, started by dora as ``dora_relay.py INDEX COUNTS``."""

from __future__ import annotations

import mmap
import sys
from pathlib import Path

import pyarrow
from dora import Node


def main() -> None:
    index = int(sys.argv[1])
    with Path(sys.argv[2]).open("r+b") as file:
        counts = memoryview(mmap.mmap(file.fileno(), 0)).cast("Q")
    node = Node()
    if index == 0:
        node.send_output("text", pyarrow.array(["x" * 32]))
    for event in node:
        if event["type"] == "INPUT":
            counts[index] += 1
            node.send_output("text", pyarrow.array([event["value"][0].as_py()]))


if __name__ == "__main__":
    main()
