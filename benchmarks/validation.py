"""Whether the cost of validating grows with the size of a system, and with nothing more.

Two systems, one ten times as large as the other, are made of nodes of one type with three
publishers and three subscriptions each, joined by connections. They are validated in turns in fresh
processes, so that nothing is remembered from one to the next. Ten times the size may take ten times
the time, and a little more for what does not stay in the caches.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.figures import Row
from benchmarks.processes import wall_time_s

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


def measure(*, long: bool) -> list[Row]:
    """Let the two systems take turns, in fresh processes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "nodes").mkdir()
        (folder / "nodes" / "worker.yaml").write_text(NODE_TYPE, encoding="utf-8")
        paths = [folder / f"system_{size}.yaml" for size in SIZES]
        for size, path in zip(SIZES, paths, strict=True):
            path.write_text(system(size), encoding="utf-8")
        turns = [[_wall_time_s(path) for path in paths] for _ in range(10 if long else 3)]
    small, large = (f"{size} nodes, {size * ENDS_PER_NODE} connections" for size in SIZES)
    theirs, ours = zip(*turns, strict=True)
    return [Row(f"compose validate, {large}", "wall s", small, ours, theirs)]


def _wall_time_s(path: Path) -> float:
    return wall_time_s("-m", "composer", "validate", path.name, folder=path.parent)
