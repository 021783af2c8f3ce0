"""Parameter files have the values that rcl reads, for the nodes that rclpy gives them to."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter as RosParameter

from composer.base.diagnostics import has_errors
from composer.language.tree import plain
from composer.loading import load
from composer.model import Node
from composer.model.names import split_node_name
from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file
from composer.runtime.children.command_line import parameter_file
from composer.runtime.node.parameters import ros_parameters
from tests.ros.support import rcl_parameters
from tests.ros.support.rcl_parameters import RclError, Values


def words(text: str) -> list[str]:
    """Return the words of a table, in which ``|`` is a space."""
    return [word.replace("|", " ") for word in text.split()]


VALUES = """\
yes Yes YES y Y on On ON true True TRUE no No NO n N off Off OFF false False FALSE tRUE yEs ~ null
.nan .NaN .NAN -.nan .inf .Inf .INF +.inf -.inf .iNF nan NaN -nan nan(1) inf -inf INF infinity
0 -0 00 010 -010 08 09.5 0o17 0x1F 0X1f -0x10 0x 0xg 0b101 1_000 + +5 -5 1. .5 . 5.0.0 12:30
1e3 1E3 1e 1e+3 1d5 1e400 -1e400 1e-310 1e-400 0e999 0x1p3 0x1.8 0x.8 0x1.8p1 0x1p2000 0x1p-2000
9223372036854775807 9223372036854775808 -9223372036854775808 -9223372036854775809 2024-01-01
99999999999999999999999999 "5" 'yes' "" '' "a\\nb" 'a\\nb' "1.0" é hello $(var x) ${HOME}
!!str|5 !!str|yes !!str|"5" !!str|~ !!int|'5' !foo|5 !!float|5 !!bool|yes !|5 &a|5
[1,|2] [1.0,|2.5] [yes,|no] [yes,|'no'] [1,|2.0] [1,|a] ['1',|2] [!!str|1,|b] [.nan,|.inf] [null,|~]
[1,|1e400] [9223372036854775807,|9223372036854775808] [a,|b,|] [1,|] [,] {a:|1} {a:|{b:|1},|c:|2}
{a.b:|{c:|1}} {1:|a,|yes:|b,|~:|c,|1.5:|d} {'':|1} [[1,|2],|[3,|4]]
"""

NAMES = """\
n a/n /a/n a/b/n a__b a__b/c 1st a/1st 1st/a 1 true a-b 'a|b' a//b /a/ / '' ~ ~/a é /* /** '*' '**'
/**/n /*/n '*/n' /a/* /a/** /a/*/**/n /**/* /a*/n /a/n* /*** /**/ ros__parameters /$(var|ns)/n
"""

FILES = [
    *(f"{name}: {{ros__parameters: {{p: 1}}}}" for name in words(NAMES)),
    # nested names
    "a: {n: {ros__parameters: {p: 1}}, m: {ros__parameters: {p: 2}}}",
    "left: {motor: {ros__parameters: {p: 1}}}\nright: {motor: {ros__parameters: {p: 2}}}",
    "/a: {n: {ros__parameters: {p: 1}}}",
    "/a/: {n: {ros__parameters: {p: 1}}}",
    "/: {n: {ros__parameters: {p: 1}}}",
    "/**: {n: {ros__parameters: {p: 1}}}",
    "a: {/n: {ros__parameters: {p: 1}}}",
    "/a: {/b: {n: {ros__parameters: {p: 1}}}}",
    "a/b: {n: {ros__parameters: {p: 1}}, m: {ros__parameters: {p: 2}}}",
    "a: {b: {n: {ros__parameters: {p: 1}}}, c: {ros__parameters: {p: 2}}}\nd: {}",
    "a: {n: {ros__parameters: {p: 1}}, ros__parameters: {p: 2}}",
    "n: {parameters: {ros__parameters: {p: 1}}}",
    # keys
    "n: {}",
    "n: {ros__parameters: {}}",
    "n: {ros__parametersX: {p: 1}}",
    "n: {ros_parameters: {p: 1}}",
    "n: {ros__params: {p: 1}}",
    "n: {parameters: {p: 1}}",
    "n: {p: 1}",
    "n: 5",
    "n: [5]",
    "n:",
    "n: {ros__parameters: 5}",
    "n: {ros__parameters: [5]}",
    "n: {ros__parameters: }",
    "n: {ros__parameters: {p: }}",
    "n: {ros__parameters: {p}}",
    "n: {ros__parameters: {p:1}}",
    "n: {ros__parameters: {ros__parameters: {a: 1}}}",
    "n: {ros__parameters: {a b: 1, a-b: 2, a/b: 3, .a: 4, a..b: 5, a.: 6, é: 7}}",
    "n: {ros__parameters: {? [a] : 1}}",
    "n: {ros__parameters: {? {a: 1} : 1}}",
    "n: {ros__parameters: {<<: {a: 1}}}",
    "'n': {\"ros__parameters\": {'p': 5}}",
    "!!str n: {!!str ros__parameters: {!!str p: 5}}",
    "n: !!map {ros__parameters: {p: !!seq [1], q: !!set [1]}}",
    "n: {ros__parameters: {p: [{a: [1, 2], b: [c]}], q: 1}}",
    # repeated keys
    "n: {ros__parameters: {p: 1, p: 2}}",
    "n: {ros__parameters: {p: [1, 2], p: [3]}}",
    "n: {ros__parameters: {p: 1}}\nm: {ros__parameters: {p: 5}}\nn: {ros__parameters: {p: 2}}",
    "n: {ros__parameters: {p: 1}}\nn: {ros__parameters: {q: 2}}",
    "n: {ros__parameters: {p: 1}}\n/n: {ros__parameters: {p: 2}}",
    "n: {ros__parameters: {a: {b: 1}, a: {c: 2}}}",
    "n: {ros__parameters: {a.b: 1, a: {b: 2}}}",
    "n: {ros__parameters: {a: {b: 2}, a: 1}}",
    # aliases
    "x: &x {ros__parameters: {p: 1}}\ny: *x",
    "n: {ros__parameters: {a: &a 1, b: *a}}",
    "x: &x {ros__parameters: {p: 1}}\ny: {<<: *x}",
    # text
    "",
    "# nothing\n",
    "# in\u200bvisible\nn: {ros__parameters: {p: 1}} # \u202e\n",
    "- a",
    "---\nn: {ros__parameters: {p: 1}}\n...\n",
    "%YAML 1.1\n---\nn: {ros__parameters: {p: 1}}",
    "n: {ros__parameters: {p: 1}}\n---\nm: {ros__parameters: {p: 2}}",
    "\ufeffn: {ros__parameters: {p: 1}}",
    "n:\r\n  ros__parameters:\r\n    p: a\r\n",
    "n:\n\tros__parameters: {p: 1}",
    "n: {ros__parameters: {p: 1",
    "n:\n  ros__parameters:\n    p: a: b\n",
    "n:\n  ros__parameters:\n    p: |-\n      5\n    q: >-\n      yes\n    r: |\n      5\n",
    "n:\n  ros__parameters:\n    p: one\n      two\n    q: 5 # comment\n    r:\n    - 1\n    - 2\n",
]  # fmt: skip

#: Where rcl misreads a file, or loses a value, and this does not; and characters that it accepts.
DIFFERENT: list[tuple[str, Values | None, Values | None]] = [
    # A second value of another type does not replace the first one.
    ("n: {ros__parameters: {p: 1, p: a}}", {"/n": {"p": 1}}, {"/n": {"p": "a"}}),
    ("n: {ros__parameters: {p: [a], p: [1]}}", {"/n": {"p": [1]}}, {"/n": {"p": [1]}}),
    ("n: {ros__parameters: {p: [1], p: []}}", {"/n": {"p": [1]}}, {"/n": {"p": []}}),
    # A map replaces the value before it.
    ("n: {ros__parameters: {a: 1, a: {b: 2}}}", {"/n": {"a.b": 2}}, {"/n": {"a": 1, "a.b": 2}}),
    # An empty map takes its neighbors in.
    ("n: {ros__parameters: {a: {}, b: 2}}", None, {"/n": {"b": 2}}),
    ("n: {ros__parameters: {a: {b: {}, c: 1}}}", {"/n": {"a.b.c": 1}}, {"/n": {"a.c": 1}}),
    ("n: {ros__parameters: {a: {}}}", {"/n": {"a": []}}, {"/n": {}}),
    # After a nested map whose key has a dot, the dot ends the wrong name.
    (
        "n: {ros__parameters: {a: {b.c: {d: 1}, e: 2}}}",
        {"/n": {"a.b.c.d": 1, "a.b.e": 2}},
        {"/n": {"a.b.c.d": 1, "a.e": 2}},
    ),
    (
        "a: {b/c: {n: {ros__parameters: {p: 1}}}, m: {ros__parameters: {p: 2}}}",
        {"/a/b/c/n": {"p": 1}, "/a/b/m": {"p": 2}},
        {"/a/b/c/n": {"p": 1}, "/a/m": {"p": 2}},
    ),
    # A node and a namespace of the same name, in this order; parameters in two parts.
    (
        "a: {ros__parameters: {p: 1}, n: {ros__parameters: {p: 2}}}",
        None,
        {"/a": {"p": 1}, "/a/n": {"p": 2}},
    ),
    (
        "n: {ros__parameters: {p: 1}, ros__parameters: {q: 2}}",
        None,
        {"/n": {"p": 1, "q": 2}},
    ),
    # Documents that are a single value.
    ("5", {}, None),
    ("n: {ros__parameters: {p: 1}}\n---\n5", {"/n": {"p": 1}}, None),
    # Lists in lists, and maps in lists.
    ("n: {ros__parameters: {p: [[]]}}", {"/n": {"p": []}}, None),
    ("n: {ros__parameters: {p: [{a: 1}]}}", {"/n": {"p.a": [1]}}, None),
    # Invisible and control characters, and texts that end at a zero byte.
    ("n: {ros__parameters: {p: a\u200b}}", {"/n": {"p": "a\u200b"}}, None),
    ('n: {ros__parameters: {p: "\\a"}}', {"/n": {"p": "\a"}}, None),
    ('n: {ros__parameters: {p: "a\\0b"}}', {"/n": {"p": "a"}}, None),
]  # fmt: skip

PATTERNS = """\
/planning/planner planning/planner planner /planner /** '**' /* '*' /planning/** /planning/*
/*/planner /**/planner '**/planner' '*/planner' /planning/planner/** /planning/planner/* /*/*
/*/*/* /**/* /**/** /*/** /**/planning/planner /**/planning/** /planning /**/planner/**
/planning/**/planner /planning/*/planner
"""


def as_rcl_reads(text: str, folder: Path) -> Values | None:
    """Return the values that rcl reads, or None if it refuses the file."""
    file = folder / "rcl.yaml"
    file.write_text(text, encoding="utf-8", newline="")
    try:
        return rcl_parameters.read(file)
    except RclError:
        return None


def as_read(text: str, folder: Path) -> Values | None:
    file = folder / "own.yaml"
    file.write_text(text, encoding="utf-8", newline="")
    files = ParameterFiles()
    if has_errors(read_parameter_file(file, files)):
        return None
    found: Values = {}
    for section in files.sections:
        values = {name: plain(entry.value) for name, entry in section.values.items()}
        found.setdefault(section.name.value, {}).update(values)
    return found


def alike(first: object, second: object) -> bool:
    """Return whether both are equal with the same types; NaN equals NaN."""
    return repr(first) == repr(second)


def differences(texts: Iterable[str], folder: Path) -> list[tuple[str, Values | None]]:
    """Return the texts that rcl reads in another way, with what it reads."""
    results = [(text, as_rcl_reads(text, folder)) for text in texts]
    return [(text, found) for text, found in results if not alike(as_read(text, folder), found)]


def test_values(tmp_path: Path) -> None:
    texts = [f"n:\n  ros__parameters:\n    p: {value}\n    q: 1\n" for value in words(VALUES)]
    assert differences(texts, tmp_path) == []


def test_files(tmp_path: Path) -> None:
    assert differences(FILES, tmp_path) == []


def test_random_numbers(tmp_path: Path) -> None:
    pick = random.Random(0)
    texts = [
        "".join(pick.choices("01789+-.exXpPaf_infa", k=pick.randint(1, 7))) for _ in range(4000)
    ]
    text = "".join(f"    p{number}: {item}\n" for number, item in enumerate(texts) if item != "-")
    text = f"n:\n  ros__parameters:\n{text}"
    assert alike(as_read(text, tmp_path), as_rcl_reads(text, tmp_path))


def test_known_differences(tmp_path: Path) -> None:
    found = [
        (text, as_rcl_reads(text, tmp_path), as_read(text, tmp_path)) for text, _, _ in DIFFERENT
    ]
    assert alike(found, DIFFERENT)


def test_names_match_the_same_nodes_as_in_rclpy(tmp_path: Path) -> None:
    file = tmp_path / "names.yaml"
    names = words(PATTERNS)
    sections = (
        f"{name}: {{ros__parameters: {{p{number}: 1}}}}" for number, name in enumerate(names)
    )
    text = "\n".join(sections)
    file.write_text(text, encoding="utf-8")
    files = ParameterFiles()
    assert read_parameter_file(file, files) == []
    declared = frozenset(f"p{number}" for number in range(len(names)))
    context = Context()
    rclpy.init(args=["--ros-args", "--params-file", str(file)], context=context)
    try:
        for namespace in ("/planning", "/", "/a/planning", "/planning/a"):
            node = RosNode(
                "planner",
                namespace=namespace,
                context=context,
                start_parameter_services=False,
                enable_rosout=False,
            )
            full_name = f"{namespace.rstrip('/')}/planner"
            assert sorted(files.given(full_name, declared)) == sorted(node._parameter_overrides)
            node.destroy_node()
    finally:
        rclpy.shutdown(context=context)


#: Types, nested names, names with slashes, repeated names, and wildcards in any order.
FIRST = """\
/robot/arm:
  ros__parameters:
    a: 1
    gains: {p: 2.0, i: {max: 1e3, min: -0.5}}
    qos_overrides: {/joint_states: {publisher: {depth: 3, reliability: best_effort}}}
    "qos_overrides./tf.subscription.depth": 7
    texts: [a, "", 'yes', "1.0", "q\\"\\\\ü: #"]
    flags: [on, no, TRUE]
    numbers: [0x10, -3, 9223372036854775807]
    doubles: [1.0, .nan, -.inf, 1e-300]
    null: null
    "\U0001f916": "\U0001f916"
    "odd name/-": !!str 5
    start_type_description_service: false
/**: {ros__parameters: {a: 2, use_sim_time: true, everywhere: here}}
robot: {arm: {ros__parameters: {b: one}}, inner: {node: {ros__parameters: {c: 1, a: 5}}}}
/*/arm: {ros__parameters: {d: first}}
"""
SECOND = """\
/robot/*: {ros__parameters: {a: 3, e: 2}}
/**/node: {ros__parameters: {c: 4.5}}
/other: {ros__parameters: {f: 1}}
"""
SYSTEM = """\
system: robot
namespace: robot
parameter_files: [first.yaml, second.yaml]
nodes:
  renamed: {{name: arm, {}}}
  kept: {{executable: {{command: [python3, -V], nodes: [base, inner/node]}}}}
  other: {{external: true, namespace: /}}
"""
PROGRAM = "executable: {command: [python3, -V]}"


@pytest.fixture
def context() -> Iterator[Context]:
    context = Context()
    rclpy.init(args=[], context=context)
    yield context
    rclpy.shutdown(context=context)


def read_by(context: Context, full_name: str, *files: Path) -> dict[str, Any]:
    """Return the values that rclpy reads from the files for a node of that name."""
    namespace, name = split_node_name(full_name)
    node = RosNode(
        name,
        namespace=namespace,
        context=context,
        cli_args=["--ros-args", *(word for file in files for word in ("--params-file", str(file)))],
        start_parameter_services=False,
        enable_rosout=False,
    )
    overrides = node._parameter_overrides
    node.destroy_node()
    return shown(overrides)


def shown(values: dict[str, RosParameter]) -> dict[str, Any]:
    return {name: (item.type_.name, repr(item.value)) for name, item in values.items()}


def node_of(folder: Path, name: str, implementation: str) -> Node:
    (folder / "first.yaml").write_text(FIRST, encoding="utf-8")
    (folder / "second.yaml").write_text(SECOND, encoding="utf-8")
    system = folder / "system.yaml"
    system.write_text(SYSTEM.format(implementation), encoding="utf-8")
    loaded = load(system)
    assert [item.message for item in loaded.diagnostics if item.severity.value == "error"] == []
    assert loaded.system is not None
    node = loaded.system.node(name)
    assert node is not None
    return node


@pytest.mark.parametrize(
    ("name", "full_name"),
    [
        ("renamed", "/robot/arm"),
        ("renamed", "/other"),  # a node of its program with a name of its own
        ("renamed", "/elsewhere"),
        ("kept", "/robot/base"),
        ("kept", "/robot/inner/node"),
        ("kept", "/other"),
    ],
)
def test_programs(name: str, full_name: str, tmp_path: Path, context: Context) -> None:
    node = node_of(tmp_path, name, PROGRAM)
    passed = tmp_path / "passed.yaml"
    passed.write_text(parameter_file(node), encoding="utf-8")
    expected = read_by(context, full_name, tmp_path / "first.yaml", tmp_path / "second.yaml")
    assert read_by(context, full_name, passed) == expected


def test_classes(tmp_path: Path, context: Context) -> None:
    node = node_of(tmp_path, "renamed", "class: 'zzz:Arm'")
    values = ros_parameters((*node.parameters, *node.undeclared_parameters))
    files = (tmp_path / "first.yaml", tmp_path / "second.yaml")
    assert shown(values) == read_by(context, "/robot/arm", *files)
