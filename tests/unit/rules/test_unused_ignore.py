"""Comments that ignore a rule: where they apply, and unused ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.source import SourceFile
from composer.loading import load
from composer.rules.ignore_comments import ignores_in
from tests.unit.support.checking import diagnostics_in, quoted, rules_broken
from tests.unit.support.growth import assert_linear

SYSTEM = """\
system: demo
nodes:
  talker:
    {before}
    publishers: {{chatter: {{type: std_msgs/msg/String, qos: command}}}}{behind}
"""


def text(before: str = "# a talker", behind: str = "") -> str:
    return SYSTEM.format(before=before, behind=behind)


@pytest.mark.parametrize(
    ("before", "behind"),
    [
        ("#", "  # compose: ignore[publisher-without-subscription]"),
        ("#", " #compose:ignore[RC324]"),
        ("#", "  # compose: ignore[publisher-without-subscription] because people listen"),
        ("# compose: ignore[publisher-without-subscription]", ""),
        ("# compose: ignore[publisher-without-subscription]\n    # and why\n", ""),
    ],
)
def test_a_comment_applies_to_its_line(before: str, behind: str, tmp_path: Path) -> None:
    assert rules_broken(text(), tmp_path) == ["publisher-without-subscription"]
    assert rules_broken(text(before, behind), tmp_path) == []


@pytest.mark.parametrize("names", ["", "[]", " RC324", "[ ] RC324"])
def test_a_comment_without_a_rule_is_reported(names: str, tmp_path: Path) -> None:
    found = diagnostics_in(text(behind=f"  # compose: ignore{names}"), tmp_path)
    assert [(item.rule.name, quoted(item)) for item in found] == [
        ("publisher-without-subscription", "chatter"),
        ("unused-ignore", "compose: ignore"),
    ]


@pytest.mark.parametrize("comment", ["composed: ignore[RC324]", "compose: ignored RC324"])
def test_other_comments_ignore_nothing(comment: str, tmp_path: Path) -> None:
    found = rules_broken(text(behind=f"  # {comment}"), tmp_path)
    assert found == ["publisher-without-subscription"]


@pytest.mark.parametrize("line", ["log: a# compose: ignore[x]", 'log: "a # compose: ignore[x]"'])
def test_text_other_than_comments_ignores_nothing(line: str) -> None:
    assert list(ignores_in(SourceFile("a.yaml", line))) == []


def test_every_unused_rule_of_a_comment_is_reported(tmp_path: Path) -> None:
    behind = (
        "  # compose: ignore[RC324, subscription-without-publisher, publisher-without-subscripton]"
    )
    found = diagnostics_in(text(behind=behind), tmp_path)
    assert [(item.rule.name, quoted(item)) for item in found] == [
        ("unused-ignore", "subscription-without-publisher"),
        ("unused-ignore", "publisher-without-subscripton"),
    ]
    assert found[1].hint == "did you mean 'publisher-without-subscription'?"


def test_a_comment_at_a_related_location_applies_too(tmp_path: Path) -> None:
    nodes = (
        "system: demo\nnodes:\n"
        "  planner: {lifecycle: {autostart: inactive}}  # MARK\n"
        "  motor_controller: {lifecycle: {depends_on: [planner]}}\n"
    )
    assert rules_broken(nodes, tmp_path) == ["start-order"]
    silenced = nodes.replace("MARK", "compose: ignore[start-order] moved by hand")
    assert rules_broken(silenced, tmp_path) == []


def test_errors_cannot_be_ignored(tmp_path: Path) -> None:
    text = (
        "system: demo\nnodes:\n"
        "  lidar:\n"
        "    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data}}  # MARK\n"
        "  mapper:\n"
        "    subscriptions: {scan: {type: std_msgs/msg/String, qos: command}}\n"
    )
    assert rules_broken(text, tmp_path) == ["qos-incompatible"]
    commented = text.replace("MARK", "compose: ignore[qos-incompatible] on purpose")
    found = diagnostics_in(commented, tmp_path)
    assert [item.rule.name for item in found] == ["unused-ignore", "qos-incompatible"]
    assert found[0].message == "'qos-incompatible' is an error here"


def test_a_comment_in_a_python_file_applies_to_that_file(tmp_path: Path) -> None:
    source = (
        "import time\n\n\nclass Slow:\n    def on_tick(self):\n        time.sleep(1.0)  # MARK\n"
    )
    system = "system: demo\nnodes:\n  a: {behavior: slow:Slow, timers: {tick: {period_ms: 1000}}}\n"
    (tmp_path / "slow.py").write_text(source, encoding="utf-8")
    assert rules_broken(system, tmp_path) == ["blocking-call"]
    silenced = source.replace("MARK", "compose: ignore[blocking-call]").replace("Slow", "Other")
    (tmp_path / "other.py").write_text(silenced, encoding="utf-8")
    assert rules_broken(system.replace("slow:Slow", "other:Other"), tmp_path) == []


def test_nothing_is_unused_if_the_file_cannot_be_read(tmp_path: Path) -> None:
    broken = "system: demo  # compose: ignore[publisher-without-subscription]\nnodes: {a: [}\n"
    assert "unused-ignore" not in rules_broken(broken, tmp_path)


def test_spans_of_rules_in_a_comment_are_exact() -> None:
    source = SourceFile("a.yaml", "key: 1  # compose: ignore[one, RC301]")
    assert [(item.rule, item.line, item.span.column) for item in ignores_in(source)] == [
        ("one", 1, 27),
        ("RC301", 1, 32),
    ]


@pytest.mark.slow
def test_many_comments_take_linear_time() -> None:
    def read(count: int) -> None:
        text = "system: a\n" + "# compose: ignore[qos-implicit]\n" * count + "nodes: {}\n"
        lines = {ignore.line for ignore in ignores_in(SourceFile("a.yaml", text))}
        assert lines == {count + 2}

    assert_linear(read, 300, 2400)


@pytest.mark.parametrize("is_inside", [True, False])
def test_files_outside_the_project_need_no_comment(is_inside: bool, tmp_path: Path) -> None:
    project = tmp_path / "project"
    project.mkdir()
    (project / "composer.yaml").touch()
    other = (project if is_inside else tmp_path) / "whole.yaml"
    other.write_text("system: whole\ninclude: [part.yaml]\n")
    if not is_inside:
        (project / "link.yaml").symlink_to(other)
    part = project / "part.yaml"
    part.write_text("system: part\nnodes: {one: {}}  # compose: ignore[start-order]\n")
    found = [item.rule.name for item in load(part).diagnostics]
    assert found == ([] if is_inside else ["unused-ignore"])
