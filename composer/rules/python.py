"""The Python code of behaviors and classes: imports, names, types and uses of the node.

The type checker runs in the background while the rules of all systems are evaluated; its findings
for the systems that are loaded become diagnostics of their rules. A class that several systems use
in the same way is checked once.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, TypeAlias

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Rule,
    Severity,
    Subject,
    error,
    shown,
    suggestion,
)
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.model import BehaviorReference, Node
from composer.python_code.checks.node_code import code_problems
from composer.python_code.lookup import BehaviorSource
from composer.python_code.modules import nearby_modules
from composer.python_code.nodes import NodeClass, use_of
from composer.python_code.problems import Family, Problem
from composer.python_code.syntax import Method
from composer.python_code.trees import start_span, walk
from composer.rules.analysis.context import (
    Context,
    distinct_behaviors,
    distinct_classes,
    is_unresolved,
    part_of,
)
from composer.rules.analysis.subjects import earlier_errors, package_subjects

if TYPE_CHECKING:
    from composer.python_code.checker.check import RunningCheck


CLASS_MISSING = error("RC460", "class-missing")

#: What a family takes for right: the ports and parameters of YAML, or a folder of the project.
_RELIES_ON: Mapping[Family, tuple[str, ...]] = {
    Family.PORT: ("port",),
    Family.FIELD: ("type",),
    Family.VALUE: ("parameter", "type"),
    Family.MESSAGE_TYPE: ("type",),
    Family.IMPORT: ("folder",),
    Family.NOT_INSTALLED: ("folder",),
}
#: What the type checker needs to know of the use of a class; equal uses are checked once.
_Use: TypeAlias = tuple[object, ...]
#: Rules about the arguments of a function: names in it, and calls of it, follow from theirs.
_ABOUT_SIGNATURES = frozenset({"handler-signature", "missing-self"})


def as_warning(rule: Rule, *, unless: bool = False) -> Rule:
    """Return a rule as a warning, unless its problem certainly keeps a system from running."""
    return rule if unless else replace(rule, severity=Severity.WARNING)


def diagnostic(
    problem: Problem, node: Node, source: BehaviorSource, interfaces: Interfaces
) -> Diagnostic:
    """Return the diagnostic of a problem in the code of a node.

    In a class nothing but its syntax is an error: it may run as it does today.
    """
    rule = problem.family.value
    what = "class" if node.behavior is None else "behavior"
    is_error = (what == "behavior" and problem.is_certain) or problem.family is Family.SYNTAX
    if rule.severity is Severity.ERROR and not is_error:
        rule = as_warning(rule)
    label = Label(source.reference.text.span, f"the {what} of this node")
    subjects = tuple(_subjects(problem, interfaces))
    given = tuple(_relies_on(problem, node, source))
    return Diagnostic(rule, problem.message, problem.span, (label,), problem.hint, subjects, given)


def _subjects(problem: Problem, interfaces: Interfaces) -> Iterator[Subject]:
    """Yield what a problem says is wrong."""
    match problem.family:
        case Family.FIELD:
            yield ("field", problem.message)
        case Family.IMPORT | Family.NOT_INSTALLED:
            yield from package_subjects(interfaces, problem.span.text)
        case Family.PARAMETER:
            yield ("undeclared parameter", problem.span.text.strip("\"'"))
        case _:
            return


def _relies_on(problem: Problem, node: Node, source: BehaviorSource) -> Iterator[Subject]:
    """Yield what a problem takes for right: ports and parameters of its line and its handler."""
    kinds = _RELIES_ON.get(problem.family, ())
    if "folder" in kinds:
        yield ("folder", "interfaces")
    if not kinds:
        return
    span = problem.span
    names = set(re.findall(r"\w+", span.file.line(span.line)))
    for method in source.methods:
        if method.span.file == span.file and _contains(method, span.line):
            names.add(method.name.removeprefix("on_").removeprefix("accept_"))
    for name in sorted(names):
        for kind in kinds:
            yield (kind, name if kind == "parameter" else f"{node.name}.{name}")


def _contains(method: Method, line: int) -> bool:
    node = method.node
    return node is not None and node.lineno <= line <= (node.end_lineno or node.lineno)


def check_python(context: Context) -> Iterator[Diagnostic]:
    """Report the problems of the files of behaviors and classes, each once."""
    for node, source, problem in _alternatives(context):
        yield diagnostic(problem, node, source, context.interfaces)
    for node, source in sources(context):
        for problem in code_problems(node, source, context.interfaces):
            yield diagnostic(problem, node, source, context.interfaces)


def sources(context: Context) -> Iterator[NodeClass]:
    """Yield the behaviors and classes of a system, each once for each way to use it."""
    yield from distinct_behaviors(context)
    for item in distinct_classes(context):
        yield item.node, item.source


def _alternatives(context: Context) -> Iterator[tuple[Node, BehaviorSource, Problem]]:
    """Yield the messages and other interfaces that a condition chooses at run time."""
    packages = context.interfaces.packages()
    modules = {
        module.path: (node, source, module)
        for node, source in sources(context)
        for module in source.own_modules
    }
    for node, source, module in modules.values():
        chosen = {
            name
            for name, origins in module.alternatives.items()
            if any(origin.module.partition(".")[0] in packages for origin in origins)
        }
        for item in walk(module.tree.body) if chosen else ():
            name = (item.asname or item.name) if isinstance(item, ast.alias) else None
            if isinstance(item, ast.alias) and name in chosen:
                chosen.remove(name)
                message = f"'{name}' is imported from several modules, so its uses are not checked"
                span = start_span(item, len(item.name), module.source)
                yield node, source, Problem(Family.NOT_CHECKED, message, span)


def unnamed(reference: BehaviorReference, what: str) -> Iterator[Diagnostic]:
    """Report a name that is not one of a class."""
    text = reference.text
    if not ((reference.module and reference.class_name) or is_unresolved(text.value)):
        message = f"{what} '{text}' is not 'module:Class'"
        yield Diagnostic(CLASS_MISSING, message, text.span, hint=_class_name_hint(text.value))


def missing(source: BehaviorSource, not_installed: Rule) -> Iterator[Diagnostic]:
    """Report what is missing; ``not_installed`` is for modules that may exist elsewhere."""
    reference = source.reference
    module, name = reference.module, reference.class_name
    span = part_of(reference.text, 0, len(module))
    if source.problem is not None:
        if not source.broken:  # or else it is reported in the module
            yield Diagnostic(CLASS_MISSING, f"module '{module}' {source.problem}", span)
    elif not source.module_found:
        nearby = nearby_modules(module, (reference.folder, *reference.node_folders))
        message = f"no Python module named '{module}'"
        path = shown(module.replace(".", "/"))
        hint = nearby.hint or (
            f"expected {path}.py next to the YAML file, among the node types,"
            " or on Python's module search path"
        )
        if nearby.package:
            message = f"package '{nearby.package}' has no module '{nearby.missing}'"
        is_misspelled = nearby.package or ("." not in module and nearby.similar)
        rule = CLASS_MISSING if is_misspelled else not_installed
        if rule is not CLASS_MISSING:
            message = (
                f"module '{module}' is not found on this computer, so its class is not checked"
            )
        yield Diagnostic(rule, message, span, hint=hint)
    elif not source.class_found:
        message = f"module '{module}' has no class '{name}'"
        span = part_of(reference.text, len(module) + 1, len(name))
        yield Diagnostic(CLASS_MISSING, message, span, hint=suggestion(name, source.class_names))


def _class_name_hint(text: str) -> str:
    """Return the hint for ``text`` in place of ``module:Class``."""
    module, _, name = text.rstrip(":").rpartition(".")
    is_dotted = bool(module) and name[:1].isupper()
    return f"did you mean '{module}:{name}'?" if is_dotted else "write 'module:Class'"


@dataclass(slots=True)
class TypeCheck:
    """The checks of all classes that some systems use, running in the background."""

    _running: list[RunningCheck] = field(default_factory=list)
    _problems: dict[_Use, list[Problem]] | None = None

    @classmethod
    def of(cls, contexts: Sequence[Context]) -> TypeCheck:
        """Start to check the Python code of the systems."""
        from composer.python_code.checker.check import start_checks  # noqa: PLC0415 - slow

        by_interfaces: dict[int, tuple[Interfaces, dict[_Use, NodeClass]]] = {}
        for context in contexts:
            key = id(context.interfaces)
            _, classes = by_interfaces.setdefault(key, (context.interfaces, {}))
            for node, source in sources(context):
                classes.setdefault(use_of(node, source), (node, source))
        return cls(
            [
                start_checks(tuple(classes.values()), interfaces)
                for interfaces, classes in by_interfaces.values()
                if classes
            ]
        )

    def diagnostics(self, context: Context, reported: Iterable[Diagnostic]) -> list[Diagnostic]:
        """Wait for the checks, and return what they found in the classes of one system.

        ``reported`` are the diagnostics of the rules. What these are about is not repeated.
        """
        if self._problems is None:
            self._problems = self._collected()
        found = [
            (node, problem, diagnostic(problem, node, source, context.interfaces))
            for node, source in sources(context)
            for problem in self._problems.get(use_of(node, source), ())
        ]
        without_self = [item for _, problem, item in found if problem.family is Family.SELF]
        others = [*reported, *without_self]
        return without_self + [
            item
            for node, problem, item in found
            if problem.family is not Family.SELF and not _follows(problem, node, context, others)
        ]

    def close(self) -> None:
        """End the checks."""
        for check in self._running:
            check.close()

    def _collected(self) -> dict[_Use, list[Problem]]:
        found: dict[_Use, list[Problem]] = {}
        for check in self._running:
            for node, source, problem in check.problems():
                found.setdefault(use_of(node, source), []).append(problem)
        return found


def _follows(
    problem: Problem, node: Node, context: Context, reported: Sequence[Diagnostic]
) -> bool:
    """Return whether a problem only follows from what a rule has reported already."""
    if problem.family is Family.PORT:
        errors = context.once(earlier_errors)
        if not node.complete or node.name.value in errors.nodes:
            return True  # the port may be declared where the file is wrong
    if problem.family is Family.ARGUMENTS and any(
        item.rule.name in _ABOUT_SIGNATURES
        and (problem.span.text.endswith(item.primary.text) or item.primary.text in problem.message)
        for item in reported
    ):
        return True
    return any(_has_reported(item, problem) for item in reported)


def _has_reported(item: Diagnostic, problem: Problem) -> bool:
    """Return whether a rule has reported the same place, or the signature of its function."""
    if item.rule.name in _ABOUT_SIGNATURES and _is_within_function(problem.span, item.primary):
        return True
    start = problem.span.column - item.primary.column
    return problem.span.is_on_line_of(item.primary) and 0 <= start < item.primary.length


def _is_within_function(span: Span, signature: Span) -> bool:
    """Return whether a place is in the function whose signature is at another one."""
    if span.file.path != signature.file.path or span.line < signature.line:
        return False
    lines = span.file.lines[signature.line : span.line]
    depth = _indentation(span.file.line(signature.line))
    return all(_indentation(line) > depth for line in lines if line.strip())


def _indentation(line: str) -> int:
    return len(line) - len(line.lstrip())
