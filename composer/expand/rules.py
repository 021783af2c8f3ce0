"""The rules of load-time variables and copies (RC28x)."""

from __future__ import annotations

from composer.diagnostics import error, info

UNKNOWN_VARIABLE = error(
    code="RC281",
    name="unknown-variable",
    summary="A variable is used or given to a node type but not declared.",
    why="It has no value, and a value for an undeclared variable has no effect.",
    bad="""\
system: demo
variables: {rate_hz: 10}
nodes:
  robot: {timers: {tick: {rate_hz: "${rate}", log: tick}, tock: {rate_hz: "${rate_hz}", log: tock}}}
""",
    good="""\
system: demo
variables: {rate_hz: 10}
nodes:
  robot: {timers: {tick: {rate_hz: "${rate_hz}", log: tick}}}
""",
)
MALFORMED_VARIABLE = error(
    code="RC282",
    name="malformed-variable",
    summary="'${' is not followed by a name and a closing brace.",
    why=(
        "'${name}' is replaced when a file is loaded, '{expression}' is evaluated at run "
        "time. There are no expressions in '${...}'."
    ),
    bad="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: 10, log: "${count + 1}"}}}
""",
    good="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: 10, log: "{count + 1}"}}}
""",
)
CYCLIC_VARIABLES = error(
    code="RC283",
    name="cyclic-variables",
    summary="Variables are defined by each other in a cycle.",
    why="None of them can be evaluated before the others.",
    bad="""\
system: demo
variables: {first: "${second}", second: "${first}"}
nodes:
  robot: {on_activate: {log: "${first}"}}
""",
    good="""\
system: demo
variables: {first: "${second}", second: started}
nodes:
  robot: {on_activate: {log: "${first}"}}
""",
)
NOT_A_TEXT = error(
    code="RC284",
    name="variable-not-string",
    summary="A variable whose value is a map or list is used inside a string.",
    why="Maps and lists cannot be inserted into a string; use '${name}' alone.",
    bad="""\
system: demo
variables: {point: {x: 1}}
nodes:
  robot: {on_activate: {log: "at ${point}"}}
""",
    good="""\
system: demo
variables: {x: 1}
nodes:
  robot: {on_activate: {log: "at ${x}"}}
""",
)
TOO_LARGE = error(
    code="RC285",
    name="variables-too-large",
    summary="A file is too large after its variables and copies are expanded.",
    why="A few lines with variables or 'for_each' can exhaust time and memory.",
    bad="variables: {a: '${b}${b}', b: '${c}${c}', c: '${d}${d}'}  # and so on",
    good="variables: {a: some text}",
)
UNUSED_VARIABLE = info(
    code="RC286",
    name="unused-variable",
    summary="A variable is declared and never used.",
    why="It may be misspelled where it is used, and changing it has no effect.",
    bad="""\
system: demo
variables: {rate_hz: 10}
nodes:
  robot: {timers: {tick: {rate_hz: 10, log: tick}}}
""",
    good="""\
system: demo
variables: {rate_hz: 10}
nodes:
  robot: {timers: {tick: {rate_hz: "${rate_hz}", log: tick}}}
""",
)
DUPLICATE_NODE_NAME = error(
    code="RC288",
    name="duplicate-node-name",
    summary="Two nodes of a system have the same name because of 'for_each' or 'include'.",
    why="Connections and dependencies would be ambiguous.",
    bad="""\
system: demo
nodes:
  camera:
    for_each: {side: [left, right]}
    on_activate: {log: "started on the ${side}"}
""",
    good="""\
system: demo
nodes:
  camera_${side}:
    for_each: {side: [left, right]}
    on_activate: {log: "started on the ${side}"}
""",
)
