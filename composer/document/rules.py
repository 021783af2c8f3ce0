"""The rules of reading (RC0xx): what keeps a text from being a tree of keys and values."""

from __future__ import annotations

from functools import partial

from composer.diagnostics import Rule, Severity, register

_error = partial(Rule, severity=Severity.ERROR)


UNREADABLE_FILE = register(
    _error(
        code="RC001",
        name="unreadable-file",
        summary="A file cannot be read, or is not a regular file.",
        why="Folders, devices and pipes hold no system; reading a pipe could block for ever.",
        bad="compose validate /dev/zero",
        good="compose validate systems/pipeline.yaml",
    )
)
FILE_TOO_LARGE = register(
    _error(
        code="RC002",
        name="file-too-large",
        summary="A file is larger than two megabytes.",
        why=(
            "Nobody writes that much YAML: it is a mistake or an attack, and reading it would take "
            "minutes and gigabytes."
        ),
        bad="compose validate recording.yaml  # 10 MB of recorded data",
        good="compose validate systems/pipeline.yaml",
    )
)
NOT_UTF8 = register(
    _error(
        code="RC003",
        name="not-utf8",
        summary="A file is not encoded as UTF-8.",
        why="YAML is Unicode. Guessing another encoding would change names silently.",
        bad="description: caf\\xe9  # Latin-1",
        good="description: café  # UTF-8",
    )
)
FORBIDDEN_CHARACTER = register(
    _error(
        code="RC004",
        name="forbidden-character",
        summary="A control character, or one that turns or hides text.",
        why=(
            "Such characters make a file look different from what it says, and steer the terminal "
            "that shows it."
        ),
        bad="""\
system: demo
nodes:
  robot: {on_activate: {log: "\\e[2Jstarted"}}
""",
        good="""\
system: demo
nodes:
  robot: {on_activate: {log: started}}
""",
    )
)
YAML_SYNTAX = register(
    _error(
        code="RC005",
        name="yaml-syntax",
        summary="The text is not YAML.",
        why="Until the text can be read, nothing else about it can be known.",
        bad="""\
system: demo
nodes:
  robot:
    on_activate:
      log: Started: {now}
""",
        good="""\
system: demo
nodes:
  robot:
    on_activate:
      log: "Started: {now}"
""",
    )
)
NESTED_TOO_DEEP = register(
    _error(
        code="RC006",
        name="nested-too-deep",
        summary="Maps and lists stand inside each other more than 32 times.",
        why="No system needs it, and programs that read such a text run out of stack.",
        bad="""\
system: demo
nodes:
  robot: {state: {memory: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]}}
""",
        good="""\
system: demo
nodes:
  robot: {state: {memory: [1]}}
""",
    )
)
TOO_MANY_VALUES = register(
    _error(
        code="RC007",
        name="too-many-values",
        summary="A file says more than 250 000 things.",
        why="Aliases let a few lines stand for more values than any program can go through.",
        bad="a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]  # and so on",
        good="a: [x, x]",
    )
)
SEVERAL_DOCUMENTS = register(
    _error(
        code="RC008",
        name="several-documents",
        summary="A file holds more than one YAML document.",
        why="One file is one system or one node type, so that its name says what is in it.",
        bad="""\
system: first
nodes:
  robot: {on_activate: {log: started}}
---
system: second
nodes:
  robot: {on_activate: {log: started}}
""",
        good="""\
system: first
nodes:
  robot: {on_activate: {log: started}}
""",
    )
)
NOT_A_MAP = register(
    _error(
        code="RC009",
        name="not-a-map",
        summary="A file is empty, or is a list or a single value.",
        why="A system and a node type are maps of keys and values.",
        bad="- system\n- pipeline",
        good="system: demo\nnodes:\n  robot: {on_activate: {log: started}}\n",
    )
)
YAML_TAG = register(
    _error(
        code="RC010",
        name="yaml-tag",
        summary="A value has a YAML tag, such as !!str or !env.",
        why="Tags would let a file decide how it is read. The language has one way to say a thing.",
        bad="""\
system: demo
description: !!str 5
nodes:
  robot: {on_activate: {log: started}}
""",
        good="""\
system: demo
description: "5"
nodes:
  robot: {on_activate: {log: started}}
""",
    )
)
DUPLICATE_KEY = register(
    _error(
        code="RC011",
        name="duplicate-key",
        summary="A key stands twice in one map.",
        why="YAML readers silently keep the last one, and half of what was written is lost.",
        bad="""\
system: demo
nodes:
  robot: {on_activate: {log: started}}
  robot: {on_activate: {log: hello}}
""",
        good="""\
system: demo
nodes:
  robot: {on_activate: {log: started}}
  second_robot: {on_activate: {log: hello}}
""",
    )
)
KEY_NOT_TEXT = register(
    _error(
        code="RC012",
        name="key-not-text",
        summary="A key is a number, a truth value, a list, a map or nothing.",
        why="Every key of the language is a word or a name.",
        bad="""\
system: demo
nodes:
  1: {on_activate: {log: started}}
""",
        good="""\
system: demo
nodes:
  robot_1: {on_activate: {log: started}}
""",
    )
)
MERGE_KEY = register(
    _error(
        code="RC013",
        name="merge-key",
        summary="A YAML merge key (<<) is used.",
        why="YAML 1.2 has no merge keys, and what they put together cannot be told from the text.",
        bad="""\
system: demo
nodes:
  robot: {<<: {executor: default}, on_activate: {log: started}}
""",
        good="""\
system: demo
nodes:
  robot: {executor: default, on_activate: {log: started}}
""",
    )
)
BAD_NUMBER = register(
    _error(
        code="RC014",
        name="bad-number",
        summary="A number is infinite, not a number, or larger than any ROS type can hold.",
        why=(
            "NaN passes every comparison with a limit, and no message field or parameter holds "
            "more than 64 bits."
        ),
        bad="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: .inf, log: tick}}}
""",
        good="""\
system: demo
nodes:
  robot: {timers: {tick: {rate_hz: 100, log: tick}}}
""",
    )
)
BAD_ALIAS = register(
    _error(
        code="RC015",
        name="bad-alias",
        summary="An alias (*name) stands for nothing, or for what it is part of.",
        why="An alias repeats what an anchor (&name) before it marks.",
        bad="""\
system: demo
nodes:
  robot: {parameters: *common}
""",
        good="""\
system: demo
nodes:
  robot: {parameters: {speed: 1.0}}
""",
    )
)
KEY_WITHOUT_VALUE = register(
    _error(
        code="RC016",
        name="key-without-value",
        summary="A key in braces has no colon and no value.",
        why="In YAML, braces make a map: an expression or a text with braces needs quotes.",
        bad="""\
system: demo
nodes:
  robot: {on_activate: {log: {now}}}
""",
        good="""\
system: demo
nodes:
  robot: {on_activate: {log: "{now}"}}
""",
    )
)
