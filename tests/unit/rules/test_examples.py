"""The examples of the rules: a bad one breaks only its own rule, a good one none."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

from composer.base.diagnostics import Rule
from composer.report.rules import all_rules, page_of
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
    # (test_outdated_interface.py), RC437 an old Python (test_checker_limits.py).
    modules = [inspect.unwrap(check).__globals__.values() for check in all_checks()]
    known = {item.code for names in modules for item in names if isinstance(item, Rule)}
    assert known - run == {"RC001", "RC307", "RC437"}
