"""The examples of the rules: a bad one breaks only its own rule, a good one none."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic, Rule
from composer.loading import load
from composer.report.rules import all_rules, page_of
from composer.rules import all_checks


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


def diagnostics_in(example: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[Diagnostic]:
    files = files_of(example)
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.chdir(folder)
    return load(Path(next(iter(files)))).diagnostics


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_bad_example_breaks_the_rule(
    rule: Rule, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = diagnostics_in(PAGES[rule].bad, tmp_path, monkeypatch)
    assert {diagnostic.rule.code for diagnostic in found} == {rule.code}


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_good_example_breaks_none(
    rule: Rule, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = diagnostics_in(PAGES[rule].good, tmp_path, monkeypatch)
    assert [f"{diagnostic.rule.code}: {diagnostic.message}" for diagnostic in found] == []


def test_all_checks_have_tested_examples() -> None:
    run = {rule.code for rule in RULES}
    # RC307 needs an installed package (test_outdated_interface.py), RC437 an old Python
    # (test_checker_limits.py).
    modules = [check.__globals__.values() for check in all_checks()]
    known = {item.code for names in modules for item in names if isinstance(item, Rule)}
    assert known - run == {"RC307", "RC437"}
