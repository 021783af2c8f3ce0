"""Comments that ignore a rule: where they apply, and unused ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.source import SourceFile
from composer.loading import load
from composer.rules.ignore_comments import ignores_in
from tests.unit.support.checking import diagnostics_in, quoted, rules_broken, write_files
from tests.unit.support.growth import assert_linear

SYSTEM = """\
system: demo
nodes:
  talker:
    {before}
    publishers: {{chatter: {{type: std_msgs/msg/String, qos: command}}}}{behind}
"""


UNHEARD = "publisher-without-subscription"
IGNORED = f"# compose: ignore[{UNHEARD}]"


@pytest.mark.parametrize(
    ("before", "behind", "expected"),
    [
        ("# a talker", "", [(UNHEARD, "chatter")]),
        ("#", f"  {IGNORED}", []),
        ("#", " #compose:ignore[RC324]", []),
        ("#", f"  {IGNORED} because people listen", []),
        (IGNORED, "", []),
        (f"{IGNORED}\n    # and why\n", "", []),
        # Other comments ignore nothing.
        ("#", "  # composed: ignore[RC324]", [(UNHEARD, "chatter")]),
        ("#", "  # compose: ignored RC324", [(UNHEARD, "chatter")]),
        # A comment without a rule is reported.
        *(
            ("#", f"  # compose: ignore{names}",
             [(UNHEARD, "chatter"), ("unused-ignore", "compose: ignore")])
            for names in ("", "[]", " RC324", "[ ] RC324")
        ),
    ],
)  # fmt: skip
def test_comments(
    before: str, behind: str, expected: list[tuple[str, str]], tmp_path: Path
) -> None:
    found = diagnostics_in(SYSTEM.format(before=before, behind=behind), tmp_path)
    assert [(item.rule.name, quoted(item)) for item in found] == expected


def test_every_unused_rule_of_a_comment_is_reported(tmp_path: Path) -> None:
    names = "RC324, subscription-without-publisher, publisher-without-subscripton"
    text = SYSTEM.format(before="#", behind=f"  # compose: ignore[{names}]")
    found = diagnostics_in(text, tmp_path)
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


def test_nothing_is_unused_if_the_file_cannot_be_read(tmp_path: Path) -> None:
    broken = "system: demo  # compose: ignore[publisher-without-subscription]\nnodes: {a: [}\n"
    assert "unused-ignore" not in rules_broken(broken, tmp_path)


def test_rules_in_a_comment_have_exact_spans_and_texts_have_no_rules() -> None:
    source = SourceFile("a.yaml", "key: 1  # compose: ignore[one, RC301]")
    found = [(item.rule, item.line, item.span.column) for item in ignores_in(source)]
    assert found == [("one", 1, 27), ("RC301", 1, 32)]
    for line in ("log: a# compose: ignore[x]", 'log: "a # compose: ignore[x]"'):
        assert list(ignores_in(SourceFile("a.yaml", line))) == []


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
    part = "system: part\nnodes: {one: {}}  # compose: ignore[start-order]\n"
    write_files(project, {"composer.yaml": "", "part.yaml": part})
    other = (project if is_inside else tmp_path) / "whole.yaml"
    other.write_text("system: whole\ninclude: [part.yaml]\n")
    if not is_inside:
        (project / "link.yaml").symlink_to(other)
    found = [item.rule.name for item in load(project / "part.yaml").diagnostics]
    assert found == ([] if is_inside else ["unused-ignore"])
