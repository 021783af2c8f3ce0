"""Modules and classes that the YAML file names and that do not exist or cannot be read."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import is_unresolved
from composer.analysis.spans import class_name_hint, part_of
from composer.diagnostics import Diagnostic, Rule, suggestion
from composer.model import BehaviorReference
from composer.project import Project
from composer.python_code.lookup import BehaviorSource
from composer.python_code.modules import nearby_modules


def unnamed(reference: BehaviorReference, what: str, rule: Rule) -> Iterator[Diagnostic]:
    """Report a name that is not one of a class."""
    text = reference.text
    if not ((reference.module and reference.class_name) or is_unresolved(text.value)):
        message = f"{what} '{text}' is not 'module:Class'"
        yield Diagnostic(rule, message, text.span, hint=class_name_hint(text.value))


def missing(
    source: BehaviorSource, module_rule: Rule, class_rule: Rule, not_installed: Rule
) -> Iterator[Diagnostic]:
    """Report what is missing; ``not_installed`` is for modules that may exist elsewhere."""
    reference = source.reference
    module, name = reference.module, reference.class_name
    span = part_of(reference.text, 0, len(module))
    if source.problem is not None:
        if not source.broken:  # or else it is reported in the module
            yield Diagnostic(module_rule, f"module '{module}' {source.problem}", span)
    elif not source.module_found:
        nearby = nearby_modules(module, reference.folder, Project.at(reference.folder))
        message = f"no Python module named '{module}'"
        hint = nearby.hint or (
            f"expected {module.replace('.', '/')}.py next to the YAML file, among the node types,"
            " or on Python's module search path"
        )
        if nearby.package:
            message = f"package '{nearby.package}' has no module '{nearby.missing}'"
        rule = module_rule if nearby.is_misspelled else not_installed
        if rule is not module_rule:
            message = (
                f"module '{module}' is not found on this computer, so its class is not checked"
            )
        yield Diagnostic(rule, message, span, hint=hint)
    elif not source.class_found:
        message = f"module '{module}' has no class '{name}'"
        span = part_of(reference.text, len(module) + 1, len(name))
        yield Diagnostic(class_rule, message, span, hint=suggestion(name, source.class_names))
