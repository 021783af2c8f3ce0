"""The rules of shape (RC1xx): keys and values that the language does not have."""

from __future__ import annotations

from functools import partial

from composer.diagnostics import Rule, Severity, register

_error = partial(Rule, severity=Severity.ERROR)

UNKNOWN_KEY = register(
    _error(
        code="RC101",
        name="unknown-key",
        summary="A key that the language does not have there.",
        why=(
            "A misspelt key that is passed over silently costs an afternoon: what it was to say "
            "is not done."
        ),
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
)
MISSING_KEY = register(
    _error(
        code="RC102",
        name="missing-key",
        summary="A key that must be there is not.",
        why="Without it the rest means nothing, and there is no value that fits most systems.",
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
)
WRONG_TYPE = register(
    _error(
        code="RC103",
        name="wrong-type",
        summary="A value is of another type than what stands there.",
        why="Numbers, texts, lists and maps are not turned into each other: that hides mistakes.",
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
)
UNKNOWN_WORD = register(
    _error(
        code="RC104",
        name="unknown-word",
        summary="A value that is none of the words allowed there.",
        why="Words are spelled as rclpy spells them, so that what is written is what ROS does.",
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
)
OUT_OF_RANGE = register(
    _error(
        code="RC105",
        name="out-of-range",
        summary="A number is too small for what it says.",
        why="A period, a rate or a number of messages of zero or less means nothing.",
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
)
KEYS_EXCLUDE_EACH_OTHER = register(
    _error(
        code="RC106",
        name="keys-exclude-each-other",
        summary="Two keys say the same thing in two ways.",
        why="One of them would have to win, and nobody could see which.",
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
)
NOTHING_THERE = register(
    _error(
        code="RC107",
        name="nothing-there",
        summary="A map or list that must hold something is empty.",
        why="A system without nodes does nothing; a connection to no port connects nothing.",
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
)
