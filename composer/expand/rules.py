"""The rules of load-time variables and copies (RC28x)."""

from __future__ import annotations

from functools import partial

from composer.diagnostics import Rule, Severity, register

_error = partial(Rule, severity=Severity.ERROR)

UNKNOWN_VARIABLE = register(
    _error(
        code="RC281",
        name="unknown-variable",
        summary="A variable is used, or given to a node type, that is not declared.",
        why="Nothing can be put in its place, and a value that nobody asks for is a mistake.",
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
)
MALFORMED_VARIABLE = register(
    _error(
        code="RC282",
        name="malformed-variable",
        summary="What stands behind '${' is not a name and a closing brace.",
        why=(
            "'${name}' is put in when a file is loaded, '{expression}' is worked out at run time; "
            "there is nothing between the two."
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
)
CYCLIC_VARIABLES = register(
    _error(
        code="RC283",
        name="cyclic-variables",
        summary="Variables stand for each other in a circle.",
        why="None of them can be worked out before the others.",
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
)
NOT_A_TEXT = register(
    _error(
        code="RC284",
        name="variable-not-text",
        summary="A variable that stands for a map or list is used inside a text.",
        why="Maps and lists have no text of their own; alone, '${name}' stands for all of them.",
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
)
TOO_LARGE = register(
    _error(
        code="RC285",
        name="variables-too-large",
        summary="With its variables put in and its copies made, a file says too much.",
        why="A few lines with variables or 'for_each' can stand for more than anybody can read.",
        bad="variables: {a: '${b}${b}', b: '${c}${c}', c: '${d}${d}'}  # and so on",
        good="variables: {a: some text}",
    )
)
UNUSED_VARIABLE = register(
    Rule(
        code="RC286",
        name="unused-variable",
        severity=Severity.INFO,
        summary="A variable is declared and never used.",
        why="It may be misspelt where it was meant, and changing it does nothing.",
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
)
DUPLICATE_NODE_NAME = register(
    _error(
        code="RC288",
        name="duplicate-node-name",
        summary="Two nodes of a system have the same name, by 'for_each' or by 'include'.",
        why="Connections and dependencies could not say which one they mean.",
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
)
