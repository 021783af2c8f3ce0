"""What the type checker says, in our words: as problems with a family and a hint.

The messages are those of the pinned version of the checker. One that is not understood is passed
on as a :attr:`Family.TYPE` problem in its own words.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field

from composer.diagnostics import nearest, suggestion
from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.none_uses import unguarded_value
from composer.python_code.checker.owners import Owner, Owners
from composer.python_code.checker.project import CheckedFile
from composer.python_code.checker.pyrefly import Finding
from composer.python_code.checker.relevance import Relevance
from composer.python_code.problems import Family, Problem
from composer.python_code.source import BehaviorSource
from composer.python_code.source.spans import span_of
from composer.source import Span

_FAMILIES = {
    "bad-argument-count": Family.ARGUMENTS,
    "bad-keyword-argument": Family.ARGUMENTS,
    "missing-argument": Family.ARGUMENTS,
    "no-matching-overload": Family.ARGUMENTS,
    "unexpected-keyword": Family.ARGUMENTS,
    "unused-coroutine": Family.AWAIT,
    "bad-return": Family.RETURN,
    "missing-attribute": Family.ATTRIBUTE,
    "missing-module-attribute": Family.IMPORT,
    "unknown-name": Family.NAME,
    "read-only": Family.TYPE,
}
_NO_ATTRIBUTE = re.compile(
    r"(?:Object of class|Class) `(?P<owner>[\w.]+)` has no (?:class )?attribute `(?P<name>\w+)`"
)
_NO_MODULE_ATTRIBUTE = re.compile(
    r"(?:No attribute `(?P<name>\w+)` in module|Could not import `(?P<imported>\w+)` from) "
    r"`(?P<module>[\w.]+)`"
)
_ARGUMENT = re.compile(
    r"Argument `(?P<given>.+?)` is not assignable to parameter `(?P<name>\w+)` "
    r"with type `(?P<expected>.+?)` in function `(?P<function>[\w.<>]+)`"
)
_KEYWORD = re.compile(
    r"(?:Unexpected keyword argument `(?P<name>\w+)`|Expected 0 positional arguments, got \d+) "
    r"in function `(?P<function>[\w.]+)`"
)
_FUNCTION = re.compile(r"in function `([\w.]+)`")
_ASSIGNMENT = re.compile(
    r"`(?P<given>.+?)` is not assignable to (?:attribute `(?P<name>\w+)` with type )?"
    r"`(?P<expected>.+?)`"
)
#: Modules besides the standard library of which every name is known.
_COMPLETE_MODULES = frozenset({"composer", "numpy", "rclpy"})
_NAME = re.compile(r"Could not find name `(?P<name>\w+)`")
#: The methods that send a message: what they do, in messages about one of another type.
_SENDING = {
    "composer.behavior.Publisher.publish": "publishes",
    "composer.behavior.Client.call": "requests",
    "composer.behavior.ActionClient.send_goal": "sends",
    "composer.behavior.Goal.publish_feedback": "expects",
}
_INTERFACE = re.compile(r"(\w+)\.(msg|srv|action)\.(\w+)\.(\w+)")
_LITERAL = re.compile(r"Literal\[(.+?)\]")
_INTERNAL = re.compile(r"\b(?:composer\.(?:typed|behavior)|_ros|builtins)\.")


def problems_of(
    findings: Iterable[Finding],
    files: Mapping[str, CheckedFile],
    behaviors: Mapping[str, Node],
    interfaces: Interfaces,
) -> list[tuple[Node, BehaviorSource, Problem]]:
    """Return what the findings mean, each with the class because of which its file is checked.

    A message is reported once for each file, where it is first found.
    """
    owners = Owners(behaviors, interfaces)
    found: list[tuple[Node, BehaviorSource, Problem]] = []
    seen: set[tuple[str, str]] = set()
    for finding, relevance in _with_relevance(findings, files):
        checked = files[finding.path]
        span = _span(finding, checked)
        is_inserted = checked.copy.is_inserted(finding.line, finding.column)
        if is_inserted or not relevance.keeps(finding, span):
            continue
        reader = _Reader(finding, checked, owners, span)
        problem = reader.problem()
        # One wrong name or type has one report, although each use of it is wrong.
        about = [*reader.about, *(f"{span.line} {item}" for item in reader.called)]
        keys = {(finding.path, text) for text in (*about, getattr(problem, "message", ""))}
        if problem is not None and seen.isdisjoint(keys):
            found.append((checked.node, checked.source, problem))
        seen |= keys
    return found


def _with_relevance(
    findings: Iterable[Finding], files: Mapping[str, CheckedFile]
) -> Iterator[tuple[Finding, Relevance]]:
    """Yield the findings in users' files, each with what decides whether it matters."""
    by_path: dict[str, list[Finding]] = {}
    for finding in findings:
        if finding.path in files:
            by_path.setdefault(finding.path, []).append(finding)
    for path, in_file in by_path.items():
        checked = files[path]
        relevance = Relevance.of(
            checked.copy,
            in_file,
            is_class=checked.node.behavior is None,
            own=checked.source.own_modules,
        )
        yield from ((finding, relevance) for finding in in_file)


def _span(finding: Finding, checked: CheckedFile) -> Span:
    """Return the place of a finding in the original file."""
    source = checked.copy.module.source
    line, column = checked.copy.place(finding.line, finding.column)
    end_line, end = checked.copy.place(finding.end_line, finding.end_column)
    text = source.line(min(line, max(len(source.lines), 1)))
    if end_line != line:
        end = len(text) + 1
    return Span(source, line, min(column, len(text) + 1), max(end - column, 1))


@dataclass(slots=True)
class _Reader:
    """One finding, with what is known about the code around it."""

    finding: Finding
    checked: CheckedFile
    owners: Owners
    span: Span
    #: The names and types that are wrong: further problems with one of them follow from this one.
    about: list[str] = field(default_factory=list)
    #: The function or message whose use in this line is wrong.
    called: list[str] = field(default_factory=list)

    @property
    def is_class(self) -> bool:
        """Whether the code is an rclpy class, not a behavior."""
        return self.checked.node.behavior is None

    def problem(self) -> Problem | None:
        """Return what the finding means, None if it does not matter."""
        match self.finding.kind:
            case "missing-attribute" | "missing-module-attribute":
                return self._attribute()
            case "bad-argument-type":
                return self._argument()
            case "bad-assignment":
                return self._assignment()
            case "unexpected-keyword" | "bad-argument-count":
                return self._keyword()
            case "unknown-name":
                return self._name()
            case "unused-coroutine":
                return self._await()
            case "bad-return":
                return self._return()
            case (
                "bad-index" | "not-callable" | "not-iterable" | "unsupported-operation"
            ) if self._is_about_none():
                return self._none()
        return self._in_its_words()

    def _made(self, family: Family, message: str, hint: str | None = None) -> Problem:
        return Problem(family, message, self.span, hint)

    def _in_its_words(self) -> Problem:
        function = _FUNCTION.search(self.finding.message)
        if function is not None:
            self.called.append(function[1])
        text = _INTERNAL.sub("", self.finding.message.partition("\n")[0])
        text = _LITERAL.sub(r"\1", text).replace("`", "'")
        family = _FAMILIES.get(self.finding.kind, Family.TYPE)
        return self._made(family, text[:1].lower() + text[1:])

    def _attribute(self) -> Problem | None:
        in_module = _NO_MODULE_ATTRIBUTE.search(self.finding.message)
        if in_module is not None:
            return self._module_attribute(in_module)
        found = list(_NO_ATTRIBUTE.finditer(self.finding.message))
        if not found:
            return self._in_its_words()
        if found[0]["owner"] == "NoneType" and len({item["owner"] for item in found}) == 1:
            return self._none()
        name = found[-1]["name"]
        if found[-1]["owner"] == "Coroutine":
            return self._unawaited_value()
        is_own = found[-1]["owner"] in self.checked.copy.module.classes
        named = found[-1]["owner"]
        owner = None if is_own else self.owners.named(named, with_api=not self.is_class)
        self._narrow_to(name)
        if owner is None:
            return self._plain_attribute(named, name)
        self.called.append(owner.name)
        return self._made(owner.family, owner.lacks(name), owner.hint(name))

    def _unawaited_value(self) -> Problem:
        """Return the problem of a name that was assigned without 'await', where it was."""
        name = self.span.text.partition(".")[0]
        calls = [
            node.value
            for node in ast.walk(self.checked.copy.module.tree)
            if isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Call)
            and ast.unparse(node.targets[0]) == name
            and node.lineno <= self.span.line
        ]
        if calls:
            call = max(calls, key=lambda item: item.lineno)
            self.span = span_of(call.func, self.span.file)
        return self._await()

    def _module_attribute(self, found: re.Match[str]) -> Problem | None:
        name, module = found["name"] or found["imported"], found["module"]
        top = module.partition(".")[0]
        if top not in sys.stdlib_module_names and top not in _COMPLETE_MODULES:
            is_interface = top in self.owners.interfaces.packages() and not found["imported"]
            if not is_interface:
                return None  # part of it may be compiled, or the composer checks its imports
        message = f"module '{module}' has no '{name}'"
        self._narrow_to(name)
        is_import = found["imported"] is not None and top in sys.stdlib_module_names
        if found["imported"]:
            self.about += [f"name {other}" for other in self._undefined_like(name)]
        family = Family.IMPORT if is_import else Family.ATTRIBUTE
        return self._made(family, message, _meant(self.finding.message))

    def _undefined_like(self, name: str) -> Iterator[str]:
        """Yield the names in the file that a misspelled import was meant to define."""
        tree = self.checked.copy.module.tree
        used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        yield from (other for other in used if nearest(other, [name]) is not None)

    def _plain_attribute(self, owner: str, name: str) -> Problem:
        self.about.append(f"type {owner}")
        hint = _meant(self.finding.message)
        class_ = self.checked.copy.module.classes.get(owner)
        if class_ is not None:
            names = _attributes_in(class_.node)
            close = nearest(name, names - {name})
            hint = f"did you mean '{close}'?" if close is not None else hint
        return self._made(Family.ATTRIBUTE, f"'{owner}' has no attribute '{name}'", hint)

    def _argument(self) -> Problem | None:
        found = _ARGUMENT.search(self.finding.message)
        if found is None:
            return self._in_its_words()
        given, expected = found["given"], found["expected"]
        if _may_only_be_none(given):
            return self._none()
        function = found["function"]
        self.called.append(function)
        interface = _INTERFACE.fullmatch(function)
        if interface is not None:
            name = found["name"] if interface[4] == "__init__" else interface[4]
            return self._value("/".join(interface.groups()[:3]), name, given)
        if function in _SENDING:
            self.about.append(f"type {given}")
            types = (self.owners.interface(expected), self.owners.interface(given))
            message = f"the port {_SENDING[function]} {types[0]}, not {types[1]}"
            if function == "composer.behavior.Goal.publish_feedback":
                message = f"the feedback is a {types[0]}, not {types[1]}"
            return self._made(Family.MESSAGE_TYPE, message, _part_hint(expected, given))
        short = function.rpartition(".")[2]
        shown = f"argument '{found['name']}' of '{short}' must be {_plain(expected)}"
        return self._made(Family.ARGUMENTS, f"{shown}, not {_plain(given)}", _time_hint(given))

    def _value(self, interface: str, name: str, given: str) -> Problem:
        """Return the problem of a value that does not fit a field."""
        type_ = self.owners.field_type(interface, name)
        message = f"field '{name}' of {interface} must be {type_ or 'something else'}"
        hint = _time_hint(given)
        if type_ is not None and type_.startswith("float") and _plain(given).lstrip("-").isdigit():
            hint = f"write {_plain(given)}.0"
        return self._made(Family.VALUE, f"{message}, not {_plain(given)}", hint)

    def _assignment(self) -> Problem | None:
        found = _ASSIGNMENT.search(self.finding.message)
        if found is None or _may_only_be_none(found["given"]):
            return None
        target = self._assigned_attribute()
        if target is None:  # a variable may change its kind, unless it is annotated
            is_annotated = _is_annotation(self.checked.copy.module.tree, self.span.line)
            return self._in_its_words() if is_annotated and not self.is_class else None
        owner = self.owners.with_field(target.attr, found["expected"])
        name = ast.unparse(target)
        if owner is not None and name != f"self.{target.attr}":
            return self._value(owner, target.attr, found["given"])
        if name.removeprefix("self.") in self.owners.attributes and not self.is_class:
            return self._made(Family.TYPE, f"'{name}' is set by the composer and must not be changed")
        return None

    def _assigned_attribute(self) -> ast.Attribute | None:
        """Return the attribute that the line assigns: ``point.x`` in ``point.x = ...``."""
        for node in ast.walk(self.checked.copy.module.tree):
            if isinstance(node, ast.Assign | ast.AugAssign) and self._holds(node):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                if isinstance(targets[0], ast.Attribute):
                    return targets[0]
        return None

    def _holds(self, node: ast.stmt) -> bool:
        return node.lineno <= self.span.line <= (node.end_lineno or node.lineno)

    def _keyword(self) -> Problem:
        found = _KEYWORD.search(self.finding.message)
        interface = None if found is None else _INTERFACE.fullmatch(found["function"])
        if found is None or interface is None or interface[4] != "__init__":
            return self._in_its_words()
        name = "/".join(interface.groups()[:3])
        self.called.append(found["function"])
        if found["name"] is None:
            message = f"{name} takes its fields by name"
            return self._made(Family.ARGUMENTS, message, f"write '{interface[3]}(field=...)'")
        owner = self.owners.message(name)
        if owner is None:
            return self._in_its_words()
        return self._made(Family.FIELD, owner.lacks(found["name"]), owner.hint(found["name"]))

    def _name(self) -> Problem:
        found = _NAME.search(self.finding.message)
        if found is None:
            return self._in_its_words()
        name = found["name"]
        self.about.append(f"name {name}")
        return self._made(Family.NAME, f"name '{name}' is not defined", self._name_hint(name))

    def _name_hint(self, name: str) -> str:
        if name in sys.stdlib_module_names:
            return f"add 'import {name}'"
        if name in self.owners.exceptions:
            return f"add 'from composer.behavior import {name}'"
        module = self.checked.copy.module
        names = {node.id for node in ast.walk(module.tree) if isinstance(node, ast.Name)}
        names |= {node.arg for node in ast.walk(module.tree) if isinstance(node, ast.arg)}
        names |= {*module.imports, *module.classes} - {name}
        alike = [other for other in names - {name} if other[:1].lower() == name[:1].lower()]
        close = nearest(name, alike)
        return f"did you mean '{close}'?" if close is not None else "import it, or define it"

    def _await(self) -> Problem:
        called = self.span.text.partition("(")[0].strip()
        return self._made(
            Family.AWAIT, f"'{called}' is asynchronous and has no effect without 'await'",
            f"write 'await {called}(...)'",
        )  # fmt: skip

    def _return(self) -> Problem | None:
        found = _ASSIGNMENT.search(self.finding.message.replace("Returned type ", ""))
        if found is None:
            return self._in_its_words()
        if _may_only_be_none(found["given"]):
            return self._none()
        expected = self.owners.interface(found["expected"])
        message = f"the function must return {expected}, not {self.owners.interface(found['given'])}"
        hint = _part_hint(found["expected"], found["given"])
        return self._made(Family.RETURN, message, hint)

    def _is_about_none(self) -> bool:
        return "`None`" in self.finding.message or "`NoneType`" in self.finding.message

    def _none(self) -> Problem | None:
        """Return the problem of a value that may be None, unless the class checks it elsewhere."""
        if self.is_class:
            return None  # in what order rclpy calls a class is not known
        name = unguarded_value(self.checked.copy.module.tree, self.span)
        if name is None:
            return None
        hint = f"check 'if {name} is None' first"
        message = f"'{name}' may be None here"
        if name.startswith("self."):
            message = f"'{name}' is None until another callback has set it"
        return Problem(Family.NONE, message, self.span, hint, is_certain=False)

    def _narrow_to(self, name: str) -> None:
        """Let the span be the name itself, in an expression that ends with it."""
        text = self.span.text
        at = text.rfind(name)
        if at >= 0:
            self.span = self.span.part(at, len(name))


def _is_annotation(tree: ast.Module, line: int) -> bool:
    return any(isinstance(node, ast.AnnAssign) and node.lineno == line for node in ast.walk(tree))


def _meant(message: str) -> str | None:
    """Return the hint of the checker."""
    found = re.search(r"Did you mean `(\w+)`\?", message)
    return f"did you mean '{found[1]}'?" if found is not None else None


def _plain(text: str) -> str:
    """Return a type as a reader knows it."""
    text = _INTERNAL.sub("", _LITERAL.sub(r"\1", text))
    return text.replace("Float | Scalar", "float").replace(" | Scalar", "").replace("Float", "float")


def _may_only_be_none(given: str) -> bool:
    """Return whether a value has the right type, or is None."""
    return given.endswith(" | None") or given.startswith("None | ")


def _time_hint(given: str) -> str | None:
    return "add '.to_msg()'" if given in ("Time", "Duration") else None


def _part_hint(expected: str, given: str) -> str | None:
    """Return a hint if the request was meant instead of the response, or the class of a service."""
    if given == f"type[{expected}]":
        return "create an object: add '()'"
    base, _, part = expected.rpartition("_")
    return f"use '{base}.{part}'" if base and given.startswith(base) else _time_hint(given)


def _attributes_in(node: ast.ClassDef) -> set[str]:
    """Return the methods of a class and the attributes that it uses."""
    names = {item.attr for item in ast.walk(node) if isinstance(item, ast.Attribute)}
    return names | {item.name for item in node.body if isinstance(item, ast.FunctionDef)}


__all__ = ["Owner", "problems_of", "suggestion"]
