"""The rules of ``include`` and ``extends`` (RC29x)."""

from __future__ import annotations

from composer.diagnostics import error

INVALID_INCLUDE = error(
    code="RC290",
    name="invalid-include",
    summary="A file cannot be included, or has an invalid prefix or namespace.",
    why=(
        "An included file is a system in the same project: files outside the project may not "
        "exist on another computer. Prefix and namespace must give valid ROS names."
    ),
    bad="""\
# file: fleet.yaml
system: fleet
include: [../robot.yaml]
nodes:
  operator: {on_activate: {log: started}}
""",
    good="""\
# file: fleet.yaml
system: fleet
include: [robot.yaml]
nodes:
  operator: {on_activate: {log: started}}
# file: robot.yaml
system: robot
nodes:
  driver: {on_activate: {log: started}}
""",
)
INCLUDE_CYCLE = error(
    code="RC291",
    name="include-cycle",
    summary="Files include each other in a cycle.",
    why="The system would be infinite.",
    bad="""\
# file: fleet.yaml
system: fleet
include: [robot.yaml]
# file: robot.yaml
system: robot
include: [fleet.yaml]
nodes:
  driver: {on_activate: {log: started}}
""",
    good="""\
# file: fleet.yaml
system: fleet
include: [robot.yaml]
# file: robot.yaml
system: robot
nodes:
  driver: {on_activate: {log: started}}
""",
)
INCLUDE_CONFLICT = error(
    code="RC292",
    name="include-conflict",
    summary="Two files of a system define the same name differently.",
    why=(
        "QoS profiles, executors, processes, hosts and chains are shared by all files of a "
        "system. One definition would silently win; use 'overrides' of the include to choose."
    ),
    bad="""\
# file: fleet.yaml
system: fleet
include: [robot.yaml]
executors: {control: {kind: single_threaded}}
nodes:
  operator: {executor: control, on_activate: {log: started}}
# file: robot.yaml
system: robot
executors: {control: {kind: events}}
nodes:
  driver: {executor: control, on_activate: {log: started}}
""",
    good="""\
# file: fleet.yaml
system: fleet
include:
  - file: robot.yaml
    overrides: {executors: {control: {kind: single_threaded}}}
executors: {control: {kind: single_threaded}}
nodes:
  operator: {executor: control, on_activate: {log: started}}
# file: robot.yaml
system: robot
executors: {control: {kind: events}}
nodes:
  driver: {executor: control, on_activate: {log: started}}
""",
)
UNKNOWN_OVERRIDE = error(
    code="RC293",
    name="unknown-override",
    summary="An include overrides something that the included file does not have.",
    why="The override would have no effect. Add new entries to the including file itself.",
    bad="""\
# file: fleet.yaml
system: fleet
include:
  - {file: robot.yaml, overrides: {nodes: {drver: {description: Drives.}}}}
# file: robot.yaml
system: robot
nodes:
  driver: {on_activate: {log: started}}
""",
    good="""\
# file: fleet.yaml
system: fleet
include:
  - {file: robot.yaml, overrides: {nodes: {driver: {description: Drives.}}}}
# file: robot.yaml
system: robot
nodes:
  driver: {on_activate: {log: started}}
""",
)
TOO_MUCH_INCLUDED = error(
    code="RC294",
    name="too-much-included",
    summary="A system with its includes is too large, or its files are nested too deep.",
    why="A few files that include each other many times can exhaust time and memory.",
    bad="include: [a.yaml, a.yaml]  # and so on in a.yaml, twenty files deep",
    good="include: [a.yaml]",
)
UNKNOWN_BASE = error(
    code="RC295",
    name="unknown-base",
    summary="A node type extends a type that does not exist.",
    why="Without the base type, the inherited ports and parameters are unknown.",
    bad="""\
# file: nodes/fast_relay.yaml
node: fast_relay
extends: rely
""",
    good="""\
# file: nodes/fast_relay.yaml
node: fast_relay
extends: relay
""",
)
EXTENDS_CYCLE = error(
    code="RC296",
    name="extends-cycle",
    summary="Node types extend each other in a cycle.",
    why="There is no type that the others could inherit from.",
    bad="""\
# file: nodes/camera.yaml
node: camera
extends: sensor
# file: nodes/sensor.yaml
node: sensor
extends: camera
""",
    good="""\
# file: nodes/camera.yaml
node: camera
extends: sensor
# file: nodes/sensor.yaml
node: sensor
publishers: {image: {type: std_msgs/msg/String, qos: sensor_data}}
timers: {tick: {rate_hz: 10, publish: {image: {data: "frame {count}"}}}}
""",
)
