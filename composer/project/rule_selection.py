"""Apply the rule settings of a project: selected, ignored and their severity."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace

from composer.base.diagnostics import Diagnostic, Rule, Severity, nearest, shown
from composer.base.source import Located
from composer.project.settings import BAD_SETTING, Settings


def apply_rule_settings(diagnostics: Iterable[Diagnostic], settings: Settings) -> list[Diagnostic]:
    """Return the selected diagnostics with the severities that the project sets.

    Errors cannot be ignored or downgraded: they prevent a system from running.
    """
    if settings.source is None:
        return list(diagnostics)
    kept = (diagnostic for diagnostic in diagnostics if _is_selected(diagnostic.rule, settings))
    return [_with_severity(diagnostic, settings) for diagnostic in kept]


def check_rule_settings(settings: Settings, rules: Collection[Rule]) -> Iterator[Diagnostic]:
    """Yield diagnostics for wrong names of rules in ``settings``."""
    for text in (*settings.select, *settings.ignore):
        if not any(rule.matches(text.value) for rule in rules):
            yield _unknown(text, rules)
    for text in settings.ignore:
        if any(_is_exactly(rule, text) and rule.severity is Severity.ERROR for rule in rules):
            yield _about_error(text, "ignored")
    for text, severity in settings.severity:
        rule = next((rule for rule in rules if _is_exactly(rule, text)), None)
        if rule is None:
            yield _unknown(text, rules)
        elif rule.severity is Severity.ERROR and severity is not Severity.ERROR:
            yield _about_error(text, f"made {_WORDS[severity]}")


_WORDS = {Severity.WARNING: "a warning", Severity.INFO: "an info"}


def _is_selected(rule: Rule, settings: Settings) -> bool:
    if rule.severity is Severity.ERROR:
        return True
    if any(rule.matches(text.value) for text in settings.ignore):
        return False
    return not settings.select or any(rule.matches(text.value) for text in settings.select)


def _with_severity(diagnostic: Diagnostic, settings: Settings) -> Diagnostic:
    rule = diagnostic.rule
    if rule.severity is Severity.ERROR:
        return diagnostic
    for text, severity in settings.severity:
        if _is_exactly(rule, text) and severity is not rule.severity:
            return replace(diagnostic, rule=replace(rule, severity=severity))
    return diagnostic


def _is_exactly(rule: Rule, text: Located[str]) -> bool:
    return text.value in {rule.code, rule.name}


def _unknown(text: Located[str], rules: Iterable[Rule]) -> Diagnostic:
    names = [name for rule in rules for name in (rule.code, rule.name)]
    message = f"there is no rule '{shown(text.value)}'"
    close = nearest(text.value, names)
    hint = f"did you mean '{close}'?" if close is not None else "'compose rule' lists the rules"
    return Diagnostic(BAD_SETTING, message, text.span, hint=hint)


def _about_error(text: Located[str], what: str) -> Diagnostic:
    message = f"'{text}' is an error, which cannot be {what}"
    return Diagnostic(BAD_SETTING, message, text.span, hint="fix the reported problem")
