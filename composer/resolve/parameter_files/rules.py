"""The rules that reading parameter files checks."""

from __future__ import annotations

from composer.diagnostics import error, warning

PARAMETER_FILE = error(
    code="RC043",
    name="parameter-file",
    summary="A ROS parameter file cannot be read, or does not have the ROS format.",
    why=(
        "A parameter file is a map of node names, each with 'ros__parameters'. It must be in "
        "the project: files outside it may not exist on another computer."
    ),
    bad="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {speed: 2.0}
""",
    good="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {ros__parameters: {speed: 2.0}}
""",
)
DUPLICATE_PARAMETER = warning(
    code="RC046",
    name="duplicate-parameter",
    summary="A parameter file sets a parameter of a node twice.",
    why="The last value takes effect, as in ROS. The other one is most likely forgotten.",
    bad="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {ros__parameters: {speed: 2.0, speed: 3.0}}
""",
    good="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {ros__parameters: {speed: 3.0}}
""",
)
PARAMETER_SUBSTITUTION = warning(
    code="RC045",
    name="parameter-substitution",
    summary="A value in a parameter file contains a substitution, which is not replaced.",
    why=(
        "Only launch files replace $(...) in parameter files, on request, and variables are "
        "for the files of the composer. The node gets the text as it is."
    ),
    bad="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  mapper: {parameters: {map_file: {type: string, default: map.yaml}}}
# file: robot.yaml
/mapper: {ros__parameters: {map_file: $(find-pkg-share maps)/hall.yaml}}
""",
    good="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  mapper: {parameters: {map_file: {type: string, default: map.yaml}}}
# file: robot.yaml
/mapper: {ros__parameters: {map_file: maps/hall.yaml}}
""",
)
