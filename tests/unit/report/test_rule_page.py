"""docs/rules.md is up to date, and every rule has its page."""

from __future__ import annotations

import runpy
from pathlib import Path

from composer.report.rules import all_rules, explain, find_rule, page_of

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"


def test_the_list_is_up_to_date() -> None:
    page = runpy.run_path(str(ROOT / "tools" / "write_rules.py"))["page"](all_rules())
    assert page == (DOCS / "rules.md").read_text(encoding="utf-8"), "run: make generate"


def test_every_page_is_of_a_rule() -> None:
    pages = {path.stem for path in (DOCS / "rules").iterdir()}
    assert pages == {rule.code for rule in all_rules()}


def test_a_rule_has_a_summary_a_reason_and_examples() -> None:
    for rule in all_rules():
        assert rule.code[:2] == "RC"
        assert rule.name == rule.name.lower().replace("_", "-")
        text = (DOCS / "rules" / f"{rule.code}.md").read_text(encoding="utf-8")
        assert text.startswith(f"# {rule.code} {rule.name}\n\n*{rule.severity.value}* - ")
        page = page_of(rule)
        for sentences in (page.summary, page.why):
            assert sentences.endswith("."), rule
        assert "" != page.bad != page.good != "", rule


def test_rules_can_be_looked_up_by_code_and_name() -> None:
    rules = all_rules()
    by_code, by_name = find_rule("rc202", rules), find_rule("unknown-node", rules)
    assert by_code is by_name is not None
    assert find_rule("nonsense", rules) is None


def test_an_explanation_is_complete() -> None:
    rule = find_rule("RC202", all_rules())
    text = explain(rule)
    for part in (rule.code, rule.name, page_of(rule).summary, "depends_on: [planer]"):
        assert part in text
