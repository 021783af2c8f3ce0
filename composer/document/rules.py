"""The rules of reading YAML (RC0xx)."""

from __future__ import annotations

from composer.diagnostics import error

UNREADABLE_FILE = error(
    code="RC001",
    name="unreadable-file",
    summary="A file cannot be read, or is not a regular file.",
    why="Folders and devices do not contain a system; reading a pipe could block forever.",
    bad="compose validate /dev/zero",
    good="compose validate systems/pipeline.yaml",
)
FILE_TOO_LARGE = error(
    code="RC002",
    name="file-too-large",
    summary="A file is larger than two megabytes.",
    why=(
        "So much YAML is a mistake or an attack, and reading it would take minutes and gigabytes."
    ),
    bad="compose validate recording.yaml  # 10 MB of recorded data",
    good="compose validate systems/pipeline.yaml",
)
NOT_UTF8 = error(
    code="RC003",
    name="not-utf8",
    summary="A file is not encoded as UTF-8.",
    why="YAML is Unicode. Guessing another encoding would change names silently.",
    bad="description: caf\\xe9  # Latin-1",
    good="description: café  # UTF-8",
)
FORBIDDEN_CHARACTER = error(
    code="RC004",
    name="forbidden-character",
    summary="A control character, or a character that hides text or changes its direction.",
    why=(
        "Such characters make a file look different from its content, and can control the "
        "terminal that shows it."
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
YAML_SYNTAX = error(
    code="RC005",
    name="yaml-syntax",
    summary="The text is not YAML.",
    why="No other check is possible until the text can be parsed.",
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
NESTED_TOO_DEEP = error(
    code="RC006",
    name="nested-too-deep",
    summary="Maps and lists are nested more than 32 levels deep.",
    why="No system needs it, and other YAML parsers run out of stack on such input.",
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
TOO_MANY_VALUES = error(
    code="RC007",
    name="too-many-values",
    summary="A file has more than 250 000 values.",
    why="With aliases, a few lines can expand to more values than a program can process.",
    bad="a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]  # and so on",
    good="a: [x, x]",
)
SEVERAL_DOCUMENTS = error(
    code="RC008",
    name="several-documents",
    summary="A file contains more than one YAML document.",
    why="Each file is one system or one node type.",
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
NOT_A_MAP = error(
    code="RC009",
    name="not-a-map",
    summary="A file is empty, or is a list or a single value.",
    why="A system and a node type are maps of keys and values.",
    bad="- system\n- pipeline",
    good="system: demo\nnodes:\n  robot: {on_activate: {log: started}}\n",
)
YAML_TAG = error(
    code="RC010",
    name="yaml-tag",
    summary="A value has a YAML tag, such as !!str or !env.",
    why="Tags change how values are read. The language has one way to write each value.",
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
DUPLICATE_KEY = error(
    code="RC011",
    name="duplicate-key",
    summary="A key occurs twice in one map.",
    why="YAML parsers silently keep the last value, and the other one is lost.",
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
KEY_NOT_STRING = error(
    code="RC012",
    name="key-not-string",
    summary="A key is a number, a boolean, a list, a map or null.",
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
MERGE_KEY = error(
    code="RC013",
    name="merge-key",
    summary="A YAML merge key (<<) is used.",
    why="YAML 1.2 has no merge keys, and their result is hard to see in the text.",
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
BAD_NUMBER = error(
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
BAD_ALIAS = error(
    code="RC015",
    name="bad-alias",
    summary="An alias (*name) has no anchor, is part of its own, or is in a parameter file.",
    why=(
        "An alias repeats the value that an anchor (&name) before it marks. ROS refuses "
        "parameter files with aliases."
    ),
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
KEY_WITHOUT_VALUE = error(
    code="RC016",
    name="key-without-value",
    summary="A key in braces has no colon and no value.",
    why="In YAML, braces start a map. An expression or a string with braces needs quotes.",
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
