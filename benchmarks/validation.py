"""Whether the cost of validating grows with the size of a system, and with nothing more.

Two systems, one ten times as large as the other, are made of nodes of one type with three
publishers and three subscriptions each, joined by connections. They are validated in turns in fresh
processes, so that nothing is remembered from one to the next.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TURNS = 5
SIZES = (200, 2000)
ENDS_PER_NODE = 3

NODE_TYPE = """\
node: worker
parameters:
  gain: {type: double, default: 1.0, minimum: 0.0, maximum: 2.0}
publishers:
  out_0: {type: std_msgs/msg/Float64, qos: sensor_data}
  out_1: {type: std_msgs/msg/Float64, qos: sensor_data}
  out_2: {type: std_msgs/msg/Float64, qos: sensor_data}
subscriptions:
  in_0: {type: std_msgs/msg/Float64, qos: sensor_data, log: "{message.data * parameters.gain}"}
  in_1: {type: std_msgs/msg/Float64, qos: sensor_data, log: "{message.data * parameters.gain}"}
  in_2: {type: std_msgs/msg/Float64, qos: sensor_data, log: "{message.data * parameters.gain}"}
timers:
  tick:
    period_ms: 100
    publish: {out_0: {data: "{count * parameters.gain}"}, out_1: {}, out_2: {}}
"""


def system(nodes: int) -> str:
    """Return the text of a system of so many nodes and three times as many connections."""
    lines = ["system: large", "nodes:"]
    for number in range(nodes):
        waits = f", lifecycle: {{depends_on: [n{number - 1}]}}" if number else ""
        lines.append(f"  n{number}: {{type: worker, parameters: {{gain: 1.5}}{waits}}}")
    lines.append("connections:")
    for number in range(nodes):
        for end in range(ENDS_PER_NODE):
            target = f"n{(number + end + 1) % nodes}.in_{end}"
            source = f"n{number}.out_{end}"
            lines.append(f"  - {{topic: /t{number}_{end}, from: {source}, to: {target}}}")
    return "\n".join(lines) + "\n"


def _seconds(path: Path) -> float:
    start = time.perf_counter()
    command = [sys.executable, "-m", "composer", "validate", path.name]
    subprocess.run(command, cwd=path.parent, check=True, capture_output=True)
    return time.perf_counter() - start


def measure(turns: int = TURNS) -> dict[int, float]:
    """Return the median of the wall time in seconds, by the number of nodes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "nodes").mkdir()
        (folder / "nodes" / "worker.yaml").write_text(NODE_TYPE, encoding="utf-8")
        paths = {size: folder / f"system_{size}.yaml" for size in SIZES}
        for size, path in paths.items():
            path.write_text(system(size), encoding="utf-8")
        times: dict[int, list[float]] = {size: [] for size in SIZES}
        for _ in range(turns):
            for size, path in paths.items():
                times[size].append(_seconds(path))
    return {size: statistics.median(seconds) for size, seconds in times.items()}


def main() -> None:
    seconds = measure()
    print(f"Validation: median wall time of {TURNS} turns")
    for size, median_s in seconds.items():
        connections = size * ENDS_PER_NODE
        print(f"  {size:>5} nodes {connections:>6} connections {median_s:>8.2f} s")
    small, large = (seconds[size] for size in SIZES)
    print(f"  ten times the size, {large / small:.1f} times the time")


if __name__ == "__main__":
    main()
