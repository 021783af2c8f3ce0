"""Scaling of ``compose validate`` with the size of a system.

Two generated systems, one ten times as large as the other, have nodes of a single type with two
publishers and two subscriptions each. They are validated alternately in new processes. Linear
scaling means a ratio of ten, or slightly more because of cache misses.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.figures import Row
from benchmarks.processes import wall_time_s

SIZES = (200, 2000)
PORTS_PER_NODE = 2

NODE_TYPE = """\
node: worker
parameters:
  gain: {type: double, default: 1.0, minimum: 0.0, maximum: 2.0}
publishers:
  out_0: {type: std_msgs/msg/Float64, qos: sensor_data}
  out_1: {type: std_msgs/msg/Float64, qos: sensor_data}
subscriptions:
  in_0: {type: std_msgs/msg/Float64, qos: sensor_data, log: "{message.data * parameters.gain}"}
  in_1: {type: std_msgs/msg/Float64, qos: sensor_data, log: "{message.data * parameters.gain}"}
timers:
  tick:
    period_ms: 100
    publish: {out_0: {data: "{count * parameters.gain}"}, out_1: {}}
"""


def system(nodes: int) -> str:
    """Return a system file with ``nodes`` nodes and twice as many connections."""
    lines = ["system: large", "nodes:"]
    for number in range(nodes):
        waits = f", lifecycle: {{depends_on: [n{number - 1}]}}" if number else ""
        lines.append(f"  n{number}: {{type: worker, parameters: {{gain: 1.5}}{waits}}}")
    lines.append("connections:")
    for number in range(nodes):
        for port in range(PORTS_PER_NODE):
            target = f"n{(number + port + 1) % nodes}.in_{port}"
            source = f"n{number}.out_{port}"
            lines.append(f"  - {{topic: /t{number}_{port}, from: {source}, to: {target}}}")
    return "\n".join(lines) + "\n"


def measure(*, long: bool) -> list[Row]:
    """Validate both systems alternately, in new processes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "nodes").mkdir()
        (folder / "nodes" / "worker.yaml").write_text(NODE_TYPE, encoding="utf-8")
        paths = [folder / f"system_{size}.yaml" for size in SIZES]
        for size, path in zip(SIZES, paths, strict=True):
            path.write_text(system(size), encoding="utf-8")
        turns = [[_wall_time_s(path) for path in paths] for _ in range(10 if long else 3)]
    small, large = (f"{size} nodes, {size * PORTS_PER_NODE} connections" for size in SIZES)
    theirs, ours = zip(*turns, strict=True)
    return [Row(f"compose validate, {large}", "wall s", small, ours, theirs)]


def _wall_time_s(path: Path) -> float:
    return wall_time_s("-m", "composer", "validate", path.name, folder=path.parent)
