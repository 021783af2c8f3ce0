"""Two ports that do not match: the diagnostic is at the one that is probably wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in

FLOAT, STRING = "std_msgs/msg/Float64", "std_msgs/msg/String"


def publisher(qos: str, name: str = "source") -> str:
    return f"  {name}: {{publishers: {{out: {{type: {FLOAT}, topic: /x, qos: {qos}}}}}}}\n"


def subscription(qos: str, name: str = "sink") -> str:
    return f"  {name}: {{subscriptions: {{in: {{type: {FLOAT}, topic: /x, qos: {qos}}}}}}}\n"


QOS = {
    "a subscription that is reliable by habit": (
        "system: demo\nnodes:\n" + publisher("sensor_data") + subscription("command"),
        ("system.yaml", 4),
    ),
    "a publisher without what a transient-local subscription asks for": (
        "system: demo\nnodes:\n" + publisher("command") + subscription("state"),
        ("system.yaml", 3),
    ),
    "the port that uses a shared profile, not the profile": (
        "system: demo\nqos_profiles: {fast: {extends: sensor_data, deadline_ms: 50}}\nnodes:\n"
        + publisher("sensor_data")
        + subscription("fast"),
        ("system.yaml", 5),
    ),
    "a policy that the port sets itself": (
        "system: demo\nnodes:\n"
        + publisher("sensor_data")
        + subscription("{extends: sensor_data,\n    deadline_ms: 50}"),
        ("system.yaml", 5),
    ),
    "one publisher that several subscriptions do not match": (
        "system: demo\nnodes:\n"
        + publisher("sensor_data")
        + subscription("command", "first")
        + subscription("{extends: command, deadline_ms: 100}", "second"),
        ("system.yaml", 3),
    ),
    "the file of the system, not the type of the other port": (
        "system: demo\nnodes:\n  sink: {type: sink}\n" + publisher("sensor_data"),
        ("system.yaml", 4),
    ),
    "the connection, not a built-in type": (
        "system: demo\nnodes:\n"
        f"  first: {{type: relay, variables: {{message_type: {FLOAT}, qos: sensor_data}},\n"
        "    subscriptions: {input: {external: true}}}\n"
        f"  last: {{type: relay, variables: {{message_type: {FLOAT}}},\n"
        "    publishers: {output: {external: true}}}\n"
        "connections:\n"
        "  - {topic: /x, from: first.output,\n     to: last.input}\n",
        ("system.yaml", 3),
    ),
}


@pytest.mark.parametrize(("text", "place"), QOS.values(), ids=QOS.keys())
def test_incompatible_qos_is_reported_once_where_to_change_it(
    tmp_path: Path, text: str, place: tuple[str, int]
) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "sink.yaml").write_text(
        f"node: sink\nsubscriptions: {{in: {{type: {FLOAT}, topic: /x, qos: command}}}}\n"
    )
    found = diagnostics_in(text, tmp_path)
    errors = [item for item in found if item.rule.name == "qos-incompatible"]
    assert [(item.primary.file.path, item.primary.line) for item in errors] == [place]
    assert all(len(item.related) > 0 for item in errors)


NODES = (
    "system: demo\nnodes:\n"
    f"  speed: {{publishers: {{out: {{type: {FLOAT}, qos: command}}}}}}\n"
    f"  name: {{publishers: {{out: {{type: {STRING}, qos: command}}}}}}\n"
    "  sink:\n    subscriptions:\n"
    f"      speed: {{type: {FLOAT}, qos: command%s}}\n"
    f"      name: {{type: {STRING}, qos: command}}\nconnections:\n"
)
TYPES = {
    "an end of another connection, in the wrong one": (
        NODES % ""
        + "  - {topic: /speed, from: speed.out, to: sink.speed}\n"
        + "  - {topic: /name, from: name.out, to: sink.speed}\n",
        [("port-connected-twice", 11)],
    ),
    "the wrong one first": (
        NODES % ""
        + "  - {topic: /name, from: name.out, to: sink.speed}\n"
        + "  - {topic: /speed, from: speed.out, to: sink.speed}\n",
        [("type-mismatch", 10)],
    ),
    "what the node does fits only its own type": (
        NODES % ', log: "{message.data + 1.0}"'
        + "  - {topic: /name, from: name.out, to: [sink.speed, sink.name]}\n",
        [("type-mismatch", 10)],
    ),
    "the wrong port of the right node": (
        NODES % "" + "  - {topic: /name, from: name.out, to: sink.speed}\n",
        [("type-mismatch", 10)],
    ),
    "two connections with the same name": (
        NODES % ""
        + "  - {topic: /name, from: name.out, to: sink.name}\n"
        + "  - {topic: /name, from: speed.out, to: sink.speed}\n",
        [("type-mismatch", 11)],
    ),
    "nothing says that the type is right": (
        NODES % "" + "  - {topic: /name, from: name.out, to: [sink.speed, sink.name]}\n",
        [("type-mismatch", 7)],
    ),
}


@pytest.mark.parametrize(("text", "expected"), TYPES.values(), ids=TYPES.keys())
def test_a_wrong_connection_is_reported_and_not_the_type_of_a_port(
    tmp_path: Path, text: str, expected: list[tuple[str, int]]
) -> None:
    found = [
        (item.rule.name, item.primary.line)
        for item in diagnostics_in(text, tmp_path)
        if item.rule.severity.value == "error"
    ]
    assert found == expected


def test_a_pattern_that_connects_twice_is_reported_once(tmp_path: Path) -> None:
    text = (
        f"system: demo\nnodes:\n  a: {{publishers: {{out: {{type: {FLOAT}, qos: command}}}}}}\n"
        f"  s_a: {{subscriptions: {{in: {{type: {FLOAT}, qos: command}}}}}}\n"
        f"  s_b: {{subscriptions: {{in: {{type: {FLOAT}, qos: command}}}}}}\n"
        "connections:\n  - {topic: /one, from: a.out, to: s_*.in}\n"
        '  - {topic: /two, to: "s_*.in"}\n'
    )
    found = [item.rule.name for item in diagnostics_in(text, tmp_path)]
    assert found.count("port-connected-twice") == 1


def test_the_syntax_of_a_class_is_reported_in_its_module(tmp_path: Path) -> None:
    (tmp_path / "robot_nodes.py").write_text("class Talker\n    pass\n")
    text = "system: demo\nnodes:\n  talker: {class: robot_nodes:Talker}\n"
    [found] = diagnostics_in(text, tmp_path)
    place = (found.rule.name, Path(found.primary.file.path).name, found.primary.line)
    assert place == ("python-syntax", "robot_nodes.py", 1)


def test_a_system_reports_a_node_type_with_another_name_than_its_file(tmp_path: Path) -> None:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "talker.yaml").write_text("node: taker\non_activate: {log: started}\n")
    text = "system: demo\nnodes:\n  a: {type: talker}\n  b: {type: talker}\n"
    [found] = diagnostics_in(text, tmp_path)
    assert (found.rule.name, Path(found.primary.file.path).name) == (
        "node-type-name",
        "talker.yaml",
    )
