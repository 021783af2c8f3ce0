"""All combinations of arguments: what is left out, and diagnostics of what is not chosen."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from textwrap import dedent

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from composer.base.diagnostics import Diagnostic, Severity
from composer.loading import load, load_files
from composer.model.resolve import OverrideOptions

ROBOT = """\
system: robot
arguments:
  simulation: false
  lidar: {choices: [velodyne, ouster], default: velodyne}
nodes:
  simulator: {if: simulation, publishers: {scan: {type: std_msgs/msg/String, qos: command}}}
  velodyne:
    if: "not simulation and lidar == 'velodyne'"
    publishers: {scan: {type: std_msgs/msg/String, qos: command}}
  ouster:
    if: "not simulation and lidar == 'ouster'"
    publishers: {scan: {type: std_msgs/msg/String, qos: command}}
  mapping:
    lifecycle: {depends_on: [simulator, velodyne, ouster]}
    subscriptions: {scan: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
connections:
  - {topic: scan, from: [simulator.scan, velodyne.scan, ouster.scan], to: mapping.scan}
"""


def written(folder: Path, text: str, **files: str) -> Path:
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(dedent(content), encoding="utf-8")
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def diagnostics_in(folder: Path, text: str, **files: str) -> list[Diagnostic]:
    [result] = load_files([written(folder, text, **files)])
    return result.diagnostics


def messages_in(folder: Path, text: str, **files: str) -> list[str]:
    return [f"{item.rule.name}: {item.message}" for item in diagnostics_in(folder, text, **files)]


PROCESSES = """\
system: p
arguments: {vision: false, cameras: 0}
executors: {fast: {kind: single_threaded}}
processes:
  perception: {nodes: [detector, camera_*]}
  display: {cpus: [0]}
nodes:
  detector: {if: vision, executor: fast}
  camera_${i}: {for_each: {i: "${cameras}"}}
  screen: {if: vision, process: display}
  base: {}
"""


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({}, set()),
        ({"vision": "true"}, {"perception", "display"}),
        ({"cameras": "2"}, {"perception"}),
    ],
)
def test_a_process_without_its_nodes_is_left_out(
    tmp_path: Path, arguments: dict[str, str], expected: set[str]
) -> None:
    values = ", ".join(f"{name}: {value}" for name, value in arguments.items())
    outer = tmp_path / "outer.yaml"
    outer.write_text(f"system: o\ninclude: [{{file: robot.yaml, arguments: {{{values}}}}}]\n")
    words = tuple(f"{name}={value}" for name, value in arguments.items())
    for result in (
        load(written(tmp_path, PROCESSES), overrides=OverrideOptions(arguments=words)),
        load(outer),
    ):
        assert result.system is not None
        assert [
            item.message for item in result.diagnostics if item.severity is Severity.ERROR
        ] == []
        assert {item.name.value for item in result.system.processes} == expected


def test_a_process_that_no_node_may_have_is_an_error(tmp_path: Path) -> None:
    text = "system: p\nprocesses: {empty: {cpus: [0]}}\nnodes: {base: {}}\n"
    assert messages_in(tmp_path, text) == ["conflicting-process: process 'empty' has no nodes"]


WRONG = ROBOT.replace("velodyne.scan, ouster.scan", "velodyne.scan, ouster.sacn")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((), {("unknown-port", True)}),
        (("lidar=ouster",), {("unknown-port", False)}),
        (("lidar=velodyne",), set()),
        (("simulation=1",), set()),
        (("lidar=oster",), {("unknown-word", False)}),
        (("lidra=ouster",), {("unknown-variable", False), ("unknown-port", True)}),
    ],
)
def test_given_arguments_leave_fewer_combinations(
    tmp_path: Path, arguments: tuple[str, ...], expected: set[tuple[str, bool]]
) -> None:
    """``expected`` are the errors, and whether each names the arguments that it needs."""
    overrides = OverrideOptions(arguments=arguments)
    [result] = load_files([written(tmp_path, WRONG)], overrides)
    errors = [item for item in result.diagnostics if item.severity is Severity.ERROR]
    assert {(item.rule.name, "(with " in item.message) for item in errors} == expected


def chosen(path: Path, *arguments: str) -> list[str]:
    """Return the nodes of the system with these arguments."""
    result = load(path, overrides=OverrideOptions(arguments=arguments))
    assert result.system is not None
    assert [item.message for item in result.diagnostics] == []
    return [node.name.value for node in result.system.nodes]


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        # in one value of one argument, in one combination, in all
        ("simulation, publishers: {scan", "simulation, publishers: {scn", [
            "unknown-port: node 'simulator' has no port 'scan' (with simulation=true)",
        ]),
        ("ouster'\"\n    publishers: {scan", "ouster'\"\n    publishers: {scn", [
            "unknown-port: node 'ouster' has no port 'scan' (with simulation=false, lidar=ouster)",
        ]),
        ("mapping.scan}", "mapping.scn}", ["unknown-port: node 'mapping' has no port 'scn'"]),
        # an end that is only there with some arguments
        ("from: [simulator.scan, velodyne.scan, ouster.scan]", "from: simulator.scan", [
            "unknown-node: 'simulator.scan' names node 'simulator', which its 'if' leaves"
            " out",
        ]),
        ("simulator.scan, velodyne.scan, ouster.scan]", "simulator.scan, velodyne.scan]", [
            "unknown-node: 'simulator.scan' names node 'simulator', which its 'if' leaves"
            " out (with simulation=false, lidar=ouster)",
            "unknown-node: 'velodyne.scan' names node 'velodyne', which its 'if' leaves"
            " out (with simulation=false, lidar=ouster)",
        ]),
        # a name that no combination has
        ("depends_on: [simulator,", "depends_on: [simulaton,", [
            "unknown-node: node 'mapping' depends on 'simulaton', which is not a node of this"
            " system",
        ]),
        # a use in one combination is a use
        ("if: simulation,", "if: simulation, executor: fast,", [
            "undeclared-name: node 'simulator' runs on 'fast', which is not an executor of this"
            " system (with simulation=true)",
        ]),
        ("nodes:\n  simulator: {", "executors: {fast: {}}\nnodes:\n  simulator: {executor: fast, ",
         []),
        ("nodes:\n", "executors: {fast: {}}\nnodes:\n",
         ["unused-declaration: no node runs on 'fast'"]),
        ("nodes:\n", "executors: {fast: {if: simulation}}\nnodes:\n",
         ["unused-declaration: no node runs on 'fast' (with simulation=true)"]),
        ("nodes:\n  simulator: {", "executors: {fast: {unless: simulation}}\n"
         "nodes:\n  simulator: {executor: fast, ", [
            "unused-declaration: no node runs on 'fast'",
            "undeclared-name: node 'simulator' runs on 'fast', which its 'unless' leaves"
            " out (with simulation=true)",
        ]),
        # a container that is only there with some arguments
        ("nodes:\n", "nodes:\n  box: {if: simulation, external: true}\n"
         "  part: {component: {package: std_msgs, plugin: B}, container: box}\n", [
            "unknown-node: node 'part' has the container 'box', which its 'if' leaves out",
        ]),
    ],
)  # fmt: skip
def test_mistakes_name_the_arguments_with_which_they_happen(
    old: str, new: str, messages: list[str], tmp_path: Path
) -> None:
    assert old in ROBOT
    assert messages_in(tmp_path, ROBOT.replace(old, new)) == messages


PART = """\
system: part
arguments: {topic: {type: string}, extra: false}
nodes:
  camera: {publishers: {image: {type: std_msgs/msg/String, qos: command}}}
  more: {if: extra, on_activate: {log: started}}
"""
WHOLE = """\
system: robot
arguments: {cameras: true}
include:
  - {file: part.yaml, if: cameras, prefix: front_, arguments: {topic: a},
     overrides: {nodes: {more: {description: another}}}}
nodes:
  viewer:
    lifecycle: {depends_on: [front_camera, front_more]}
    subscriptions: {image: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
connections:
  - {topic: image, if: cameras, from: front_camera.image, to: viewer.image}
"""


@pytest.mark.parametrize(
    ("old", "new", "rules"),
    [
        ("arguments: {topic: {type: string}", "arguments: {topic: {type: string}", []),
        # the connection is there without the include
        ("image, if: cameras,", "image,", ["unknown-node"]),
        (", arguments: {topic: a}", "", ["missing-variable"]),
        ("front_more]", "front_mor]", ["unknown-node"]),
        # without the file, no node of it has a known name
        ("file: part.yaml", "file: parts.yaml", ["invalid-include"]),
    ],
)
def test_an_include_may_be_left_out(old: str, new: str, rules: list[str], tmp_path: Path) -> None:
    text = WHOLE.replace(old, new)
    part = PART.replace("system: part", 'system: part\nnamespace: "${topic}"')
    found = diagnostics_in(tmp_path, text, part=part)
    known = {"subscription-without-publisher"}  # without the camera
    assert [item.rule.name for item in found if item.rule.name not in known] == rules


LOOP = """\
system: fleet
arguments: {robots: 2}
nodes:
  robot_${i}:
    for_each: {i: "${robots}"}
    publishers: {state: {type: std_msgs/msg/String, qos: command}}
  tower:
    lifecycle: {depends_on: [robot_*]}
    subscriptions: {state: {type: std_msgs/msg/String, qos: command, external: true, log: hello}}
connections:
  - {topic: state, from: robot_*.state, to: tower.state}
"""
COPIES = """\
system: fleet
arguments: {robots: 1}
include: [{file: part.yaml, for_each: {i: "${robots}"}, prefix: "robot_${i}_"}]
nodes: {tower: {lifecycle: {depends_on: [robot_*_arm]}, on_activate: {log: started}}}
"""


@pytest.mark.parametrize(
    ("text", "arguments", "nodes"),
    [
        (ROBOT, (), ["velodyne", "mapping"]),
        (ROBOT, ("lidar=ouster",), ["ouster", "mapping"]),
        (ROBOT, ("lidar=ouster", "simulation=True"), ["simulator", "mapping"]),
        (LOOP, ("robots=0",), ["tower"]),
        (LOOP, ("robots=1",), ["robot_0", "tower"]),
        (COPIES, ("robots=0",), ["tower"]),
        (COPIES, (), ["robot_0_arm", "tower"]),
    ],
)
def test_arguments_choose_the_nodes(
    tmp_path: Path, text: str, arguments: tuple[str, ...], nodes: list[str]
) -> None:
    part = "system: part\nnodes: {arm: {on_activate: {log: started}}}"
    assert chosen(written(tmp_path, text, part=part), *arguments) == nodes
    assert text is not ROBOT or diagnostics_in(tmp_path, text) == []


def test_an_argument_without_a_value_is_needed_to_run_only(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "system: s\narguments: {mode: {choices: [slow, fast]}, name: {type: string}}\n"
        'nodes: {"n${name}": {if: mode == \'fast\', on_activate: {log: "${mode}"}}}\n',
    )
    assert load_files([path])[0].diagnostics == []
    missing = [(item.rule.name, item.hint) for item in load(path).diagnostics]
    assert missing == [
        ("missing-variable", "add it to the command: mode=slow or mode=fast"),
        ("missing-variable", "add it to the command: name=VALUE"),
    ]
    assert chosen(path, "mode=fast", "name=12") == ["n12"]


@pytest.mark.parametrize(
    ("options", "others", "limit"),
    [
        (7, 1, "128 combinations, more than 64"),  # each value is checked
        (6, 2400, "64 combinations, too many for a system"),  # fewer combinations are checked
    ],
)
def test_of_too_many_combinations_some_are_checked(
    tmp_path: Path, options: int, others: int, limit: str
) -> None:
    names = [f"option_{number}" for number in range(options)]
    other = "  n#: {unless: option_0, on_activate: {log: x}}\n"
    text = "system: s\narguments:\n" + "".join(f"  {name}: false\n" for name in names) + "nodes:\n"
    text += "".join(f"  {name}: {{if: {name}, executor: fast}}\n" for name in names)
    text += "".join(other.replace("#", str(number)) for number in range(others))
    first, *found = messages_in(tmp_path, text)
    assert first.startswith(f"too-large: the arguments have {limit}")
    if options == 7:
        pairs = zip(names, found, strict=True)
        assert all(f"(with {name}=true)" in message for name, message in pairs)
    else:
        assert 0 < len(found) < len(names)


CONDITIONS = (
    "", "if: a, ", "unless: a, ", "if: b == 'y', ", "if: a and b == 'x', ", "unless: b == 'z', "
)  # fmt: skip
ENDS = ("one.out", "[one.out, two.out]", '"*.out"', "two.out")


@st.composite
def systems(draw: st.DrawFn) -> str:
    node = "{%spublishers: {out: {type: std_msgs/msg/%s, qos: command}}%s}"
    nodes = [
        node
        % (
            draw(st.sampled_from(CONDITIONS)),
            draw(st.sampled_from(["String", "Bool"])),
            draw(st.sampled_from(["", ", executor: fast", ", lifecycle: {depends_on: [one]}"])),
        )
        for _ in range(2)
    ]
    connection = (
        f"{{{draw(st.sampled_from(CONDITIONS))}topic: t, from: {draw(st.sampled_from(ENDS))},"
        " to: sink.in}"
    )
    return (
        "system: robot\narguments: {a: false, b: {choices: [x, y, z], default: x}}\n"
        f"executors: {{fast: {{{draw(st.sampled_from(CONDITIONS)).rstrip(', ')}}}}}\n"
        f"nodes:\n  one: {nodes[0]}\n  two: {nodes[1]}\n"
        "  sink: {subscriptions: {in: {type: std_msgs/msg/String, qos: command, log: x}}}\n"
        f"connections:\n  - {connection}\n"
    )


def errors_of(diagnostics: list[Diagnostic]) -> Iterator[tuple[str, str]]:
    for item in diagnostics:
        if item.severity.value != "info":
            yield item.rule.name, str(item.primary)


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(systems())
def test_all_combinations_are_the_union_of_each(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    [result] = load_files([path])
    single = set()
    for a, b in product(("true", "false"), "xyz"):
        overrides = OverrideOptions(arguments=(f"a={a}", f"b={b}"))
        single |= set(errors_of(load(path, overrides=overrides).diagnostics))
    assert set(errors_of(result.diagnostics)) == single
    assert len(list(errors_of(result.diagnostics))) == len(single)
