"""``for_each``: copies of nodes, connections and includes, and their limits."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.language.expand import expand
from composer.language.rules import MAX_COPIES
from composer.language.tree import Plain, plain
from tests.unit.support.checking import diagnostics_in, places
from tests.unit.support.resolving import tree_of


def nodes(written: str, variables: str = "{}") -> Plain:
    text = f"system: s\narguments: {variables}\nnodes: {written}"
    tree, diagnostics, *_ = expand(tree_of(text), {})
    assert [item.message for item in diagnostics if item.rule.name != "unused-declaration"] == []
    return plain(tree.get("nodes"))


@pytest.mark.parametrize(
    ("written", "result"),
    [
        ("{'a_${i}': {for_each: {i: 2}}}", {"a_0": {}, "a_1": {}}),
        ("{'a_${i}': {for_each: {i: [0, 1]}, x: '${i}'}}", {"a_0": {"x": 0}, "a_1": {"x": 1}}),
        ("{'${i}': {for_each: {i: [b, c]}, x: '${i}!'}}", {"b": {"x": "b!"}, "c": {"x": "c!"}}),
        ("{'a${i}${j}': {for_each: {i: 1, j: [x, y]}}}", {"a0x": {}, "a0y": {}}),
        ("{'a_${i}': {for_each: {i: '${many}'}}}", {"a_p": {}, "a_q": {}}),
        ("{'a_${i}': {for_each: {i: '${count}'}}}", {"a_0": {}}),
        ("{'${name}_camera': {}}", {"front_camera": {}}),
        ("{'a_${i}': {for_each: {i: []}}, b: {}}", {"b": {}}),
        ("{'a_${i}': {for_each: {i: 0, j: 2}}, b: {}}", {"b": {}}),
        # a name of its own overrides the file's
        ("{'a_${name}': {for_each: {name: [back]}, x: '${name}'}}", {"a_back": {"x": "back"}}),
        ("{'a_${i}': {for_each: {i: 1}, x: [1, '$${i}']}}", {"a_0": {"x": [1, "${i}"]}}),
    ],
)  # fmt: skip
def test_nodes(written: str, result: Plain) -> None:
    assert nodes(written, "{many: [p, q], count: 1, name: front}") == result


def test_connections_and_includes() -> None:
    text = """\
system: s
include: [{for_each: {r: [a, b]}, file: '${r}.yaml'}, c.yaml]
connections: [{for_each: {r: [a, b]}, topic: '/${r}', from: '${r}.out'}]
"""
    tree, diagnostics, *_ = expand(tree_of(text), {})
    assert diagnostics == []
    assert plain(tree) == {
        "system": "s",
        "include": [{"file": "a.yaml"}, {"file": "b.yaml"}, "c.yaml"],
        "connections": [{"topic": "/a", "from": "a.out"}, {"topic": "/b", "from": "b.out"}],
    }


@pytest.mark.parametrize(
    ("loops", "rule", "place"),
    [
        ("{}", "empty-collection", "4:5"),
        ("[a]", "wrong-type", "4:15"),
        ("{i: -1}", "out-of-range", "4:19"),
        ("{i: text}", "wrong-type", "4:19"),
        ("{i: [{}]}", "wrong-type", "4:20"),
        ("{i: [null]}", "wrong-type", "4:20"),
        ("{i: '${j}'}", "unknown-variable", "4:20"),
        (f"{{i: {MAX_COPIES + 1}}}", "too-large", "4:15"),
        ("{i: 1000000000000}", "too-large", "4:15"),
        ("{i: 2000, j: 2000, k: 2000}", "too-large", "4:15"),
    ],
)
def test_what_is_wrong_with_it(tmp_path: Path, loops: str, rule: str, place: str) -> None:
    text = f"""\
system: s
nodes:
  a_${{i}}:
    for_each: {loops}
    timers: {{tick: {{rate_hz: 1, log: "${{i}} ticks"}}}}
  b: {{lifecycle: {{depends_on: [a_0]}}}}
"""
    [diagnostic] = diagnostics_in(text, tmp_path)
    assert (diagnostic.rule.name, str(diagnostic.primary)) == (rule, f"system.yaml:{place}")


def test_mistakes_in_copies_are_reported_once(tmp_path: Path) -> None:
    text = """\
system: s
nodes:
  camera_${i}:
    for_each: {i: 20}
    lifecycle: {depends_on: ["lamp_${i}"]}
    publishers: {image: {type: std_msgs/msg/String, qos: command, dpth: 1}}
"""
    assert places(diagnostics_in(text, tmp_path)) == [
        "system.yaml:5:30 unknown-node",
        "system.yaml:6:67 unknown-key",
    ]


def test_patterns_stand_for_all_that_fit(tmp_path: Path) -> None:
    text = """\
system: s
nodes:
  camera_${i}:
    for_each: {i: 3}
    publishers: {image: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {rate_hz: 1, publish: {image: {data: "frame {count}"}}}}
  viewer:
    lifecycle: {depends_on: {camera_*: active}}
    subscriptions: {image: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
connections:
  - {topic: /images, from: ["c*_?.image", "*_*.image"], to: viewer.image}
"""
    [found] = diagnostics_in(text, tmp_path)  # a star is the only sign that stands for others
    assert found.message == "'c*_?.image' names node 'c*_?', which is not a node of this system"


@pytest.mark.parametrize(("value", "kind"), [("{default: {b: c}}", "a map"), ("[]", "a list")])
def test_a_map_or_list_is_not_a_name(tmp_path: Path, value: str, kind: str) -> None:
    nodes = "nodes:\n  ${a}: {on_activate: {log: started}}\n"
    text = f"system: s\narguments: {{a: {value}}}\n{nodes}"
    found = diagnostics_in(text, tmp_path)
    assert places(found) == ["system.yaml:4:3 malformed-variable"]
    assert found[0].message == f"'${{a}}' is {kind}, which cannot be a name"
