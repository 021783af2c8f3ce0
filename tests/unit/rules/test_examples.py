"""The pages of rules: each rule has one; a bad example breaks only its rule, a good one none."""

from __future__ import annotations

import inspect
import re
import runpy
from pathlib import Path

from composer.base.diagnostics import Rule
from composer.python_code.problems import Family
from composer.report.rules import all_rules, explain, find_rule, page_of
from composer.rules import all_checks
from tests.unit.support.checking import diagnostics_of_each


def files_of(example: str) -> dict[str, str]:
    """Return the files of an example by name, starting with the one to validate.

    Each of several files is under a line with its name. An example that is not a YAML file, such
    as a command line, has none.
    """
    _, *named = re.split(r"^# file: (.+)\n", example, flags=re.MULTILINE)
    if named:
        return dict(zip(named[::2], named[1::2], strict=True))
    marker = re.match(r"(system|node): *(\w+)", example)
    if marker is None:
        return {}
    return {f"{marker[2]}.yaml" if marker[1] == "node" else "system.yaml": example}


# Examples other than system files, such as command lines, are not tested here.
PAGES = {rule: page_of(rule) for rule in all_rules()}
RULES = [rule for rule, page in PAGES.items() if files_of(page.bad) and files_of(page.good)]


def test_a_bad_example_breaks_only_its_rule_and_a_good_one_none(tmp_path: Path) -> None:
    examples = [
        files_of(example) for rule in RULES for example in (PAGES[rule].bad, PAGES[rule].good)
    ]
    results = diagnostics_of_each(examples, tmp_path)
    for rule, bad, good in zip(RULES, results[::2], results[1::2], strict=True):
        assert {diagnostic.rule.code for diagnostic in bad} == {rule.code}
        shown = [f"{diagnostic.rule.code}: {diagnostic.message}" for diagnostic in good]
        assert shown == [], rule.name


def test_all_checks_have_tested_examples() -> None:
    run = {rule.code for rule in RULES}
    # RC001 needs a file that cannot be read or is not there, RC307 an installed package
    # (test_projects.py), RC437 an old Python (test_checker_limits.py).
    modules = [inspect.unwrap(check).__globals__.values() for check in all_checks()]
    known = {item.code for names in modules for item in names if isinstance(item, Rule)}
    known |= {family.value.code for family in Family}
    assert known - run == {"RC001", "RC307", "RC437"}


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
