"""docs/rules.md is up to date, and every rule has its page."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.diagnostics import Rule
from composer.report.rules import (
    BANDS,
    all_rules,
    explain,
    files_of,
    find_rule,
    index,
    page_of,
)

DOCS = Path(__file__).parents[3] / "docs"


def test_the_list_is_up_to_date() -> None:
    current = (DOCS / "rules.md").read_text(encoding="utf-8")
    assert current == index(all_rules()), "run: python tools/write_rules.py"


def test_every_page_is_of_a_rule() -> None:
    pages = {path.stem for path in (DOCS / "rules").iterdir()}
    assert pages == {rule.code for rule in all_rules()}


@pytest.mark.parametrize("rule", all_rules(), ids=lambda rule: rule.code)
def test_a_rule_has_a_summary_a_reason_and_examples(rule: Rule) -> None:
    assert rule.code[:2] == "RC"
    assert rule.code[2] in BANDS
    assert rule.name == rule.name.lower().replace("_", "-")
    text = (DOCS / "rules" / f"{rule.code}.md").read_text(encoding="utf-8")
    assert text.startswith(f"# {rule.code} {rule.name}\n\n*{rule.severity.value}* - ")
    page = page_of(rule)
    for sentences in (page.summary, page.why):
        assert sentences.endswith(".")
    assert "" != page.bad != page.good != ""


def test_rules_can_be_looked_up_by_code_and_name() -> None:
    rules = all_rules()
    by_code, by_name = find_rule("rc202", rules), find_rule("unknown-node", rules)
    assert by_code is by_name is not None
    assert find_rule("nonsense", rules) is None


def test_an_explanation_is_complete() -> None:
    rule = find_rule("RC202", all_rules())
    assert rule is not None
    text = explain(rule)
    for part in (rule.code, rule.name, page_of(rule).summary, "depends_on: [planer]"):
        assert part in text


def test_examples_are_split_into_their_files() -> None:
    files = files_of("# file: system.yaml\nsystem: a\n# file: nodes/b.py\nclass B:\n    pass\n")
    assert files == {"system.yaml": "system: a\n", "nodes/b.py": "class B:\n    pass\n"}
    assert files_of("node: planner\n") == {"planner.yaml": "node: planner\n"}
    assert files_of("compose run x") == {}
