"""The rules of the schema (RC1xx): keys and values that the language does not have."""

from __future__ import annotations

from composer.diagnostics import error

UNKNOWN_KEY = error(
    code="RC101",
    name="unknown-key",
    summary="A key is not valid in its context.",
    why=("A misspelled key that is silently ignored is hard to find: its value has no effect."),
    bad="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: 10, lgo: tick, log: tock}}}
""",
    good="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: 10, log: tick}}}
""",
)
MISSING_KEY = error(
    code="RC102",
    name="missing-key",
    summary="A required key is missing.",
    why="The entry is incomplete without it, and there is no sensible default.",
    bad="""\
system: demo
nodes:
  robot:
    publishers: {status: {qos: state, external: true}}
""",
    good="""\
system: demo
nodes:
  robot:
    publishers: {status: {type: std_msgs/msg/String, qos: state, external: true}}
""",
)
WRONG_TYPE = error(
    code="RC103",
    name="wrong-type",
    summary="A value has the wrong type.",
    why="Values are not converted to other types, since that hides mistakes.",
    bad="""\
system: demo
nodes:
  robot: {timers: {tick: {period_ms: "1 s", log: tick}}}
""",
    good="""\
system: demo
nodes:
  robot: {timers: {tick: {period_ms: 1000, log: tick}}}
""",
)
UNKNOWN_WORD = error(
    code="RC104",
    name="unknown-word",
    summary="A value is not one of the allowed words.",
    why="The words are those of rclpy.",
    bad="""\
system: demo
lifecycle: {autostart: activ}
nodes:
  robot: {on_activate: {log: started}}
""",
    good="""\
system: demo
lifecycle: {autostart: active}
nodes:
  robot: {on_activate: {log: started}}
""",
)
OUT_OF_RANGE = error(
    code="RC105",
    name="out-of-range",
    summary="A number is outside the allowed range.",
    why="For example, a period, rate or queue depth must be positive.",
    bad="""\
system: demo
nodes:
  robot: {timers: {tick: {period_ms: 0, log: tick}}}
""",
    good="""\
system: demo
nodes:
  robot: {timers: {tick: {period_ms: 10, log: tick}}}
""",
)
KEYS_EXCLUDE_EACH_OTHER = error(
    code="RC106",
    name="keys-exclude-each-other",
    summary="Two keys that exclude each other are used together.",
    why="It would be unclear which of the two applies.",
    bad="""\
system: demo
nodes:
  robot: {timers: {tick: {period_ms: 100, rate_hz: 10, log: tick}}}
""",
    good="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: 10, log: tick}}}
""",
)
EMPTY_COLLECTION = error(
    code="RC107",
    name="empty-collection",
    summary="A map or list is empty, or has fewer entries than required.",
    why="A system without nodes, a connection without ports and a chain of one do nothing.",
    bad="""\
system: demo
nodes: {}
""",
    good="""\
system: demo
nodes:
  robot: {on_activate: {log: started}}
""",
)
