"""The rules of ``include`` and ``extends`` (RC29x)."""

from __future__ import annotations

from functools import partial

from composer.diagnostics import Rule, Severity, register

_error = partial(Rule, severity=Severity.ERROR)

INVALID_INCLUDE = register(
    _error(
        code="RC290",
        name="invalid-include",
        summary="A file cannot be included, or not in the way that is asked for.",
        why=(
            "What is included is a system in the same project: what is outside is not there on "
            "another computer. A prefix or namespace makes names that ROS must take."
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
)
INCLUDE_CYCLE = register(
    _error(
        code="RC291",
        name="include-cycle",
        summary="Files include each other in a circle.",
        why="The system would have no end.",
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
)
INCLUDE_CONFLICT = register(
    _error(
        code="RC292",
        name="include-conflict",
        summary="Two files say different things under one name, and a system has both.",
        why=(
            "QoS profiles, executors and chains are shared by all files of a system. One of the "
            "two would silently win; 'overrides' of the include says which."
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
)
UNKNOWN_OVERRIDE = register(
    _error(
        code="RC293",
        name="unknown-override",
        summary="An include overrides something that the included file does not have.",
        why="It would change nothing; what is new stands in the including file itself.",
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
)
TOO_MUCH_INCLUDED = register(
    _error(
        code="RC294",
        name="too-much-included",
        summary="With all that it includes, a system says too much, or files nest too deep.",
        why="A few files that include each other many times stand for more than anybody can read.",
        bad="include: [a.yaml, a.yaml]  # and so on in a.yaml, twenty files deep",
        good="include: [a.yaml]",
    )
)
UNKNOWN_BASE = register(
    _error(
        code="RC295",
        name="unknown-base",
        summary="A node type extends one that there is no file for.",
        why="Without it nothing is known of what it inherits.",
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
)
EXTENDS_CYCLE = register(
    _error(
        code="RC296",
        name="extends-cycle",
        summary="Node types extend each other in a circle.",
        why="None of them says what all of them inherit.",
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
)
