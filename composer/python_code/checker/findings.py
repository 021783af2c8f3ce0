"""What the type checker finds, as problems: in its own words, with a family and our hint.

Only what the checker cannot know has words of ours: imports, a missing ``await`` or ``self``,
values that may be None, and the message types of ports. The patterns fit the pinned version.
"""

from __future__ import annotations

import ast
import re
import sys

from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.python_code.checker.imports import Imports, Owner
from composer.python_code.checker.pyrefly import MISSING_RETURN, Finding
from composer.python_code.checker.relevance import (
    ARGUMENT,
    NO_ATTRIBUTE,
    Relevance,
    is_parameter,
    unguarded_value,
)
from composer.python_code.nodes import API_NAMES
from composer.python_code.problems import Family, Problem
from composer.python_code.trees import Function, is_none, name_span, positional_arguments

_FAMILIES = {
    "invalid-syntax": Family.SYNTAX,
    "parse-error": Family.SYNTAX,
    "bad-argument-count": Family.ARGUMENTS,
    "bad-keyword-argument": Family.ARGUMENTS,
    "missing-argument": Family.ARGUMENTS,
    "no-matching-overload": Family.ARGUMENTS,
    "unexpected-keyword": Family.ARGUMENTS,
    "bad-return": Family.RETURN,
    "missing-attribute": Family.ATTRIBUTE,
    "unknown-name": Family.NAME,
}
_NO_MODULE_ATTRIBUTE = (
    r"(?:No attribute `(?P<name>\w+)` in module|Could not import `(?P<imported>\w+)` from) "
    r"`(?P<module>[\w.]+)`"
)
_ASSIGNMENT = (
    r"`(?P<given>.+?)` is not assignable to (?:attribute `\w+` with type |declared return type )?"
    r"`(?P<expected>.+?)`"
)
_MEANT = r"Did you mean `(\w+)`\?"
#: A function of a message class: its constructor, or the setter of a field.
_OF_MESSAGE = r"(\w+)\.(msg|srv|action)\.(\w+)\.(\w+)"
_LITERAL = r"Literal\[(.+?)\]"
_MODULE = r"\b(?:composer\.(?:typed|behavior)|_ros|builtins)\."
#: The methods of a behavior that send a message.
_SENDING = r"composer\.behavior\.\w+\.(?:publish|call|send_goal|publish_feedback)"
#: Modules besides the standard library of which every name is known.
_COMPLETE_MODULES = frozenset({"composer", "numpy", "rclpy"})


@dataclass(slots=True)
class Reader:
    """One finding, with what is known about the code around it."""

    finding: Finding
    span: Span
    known: Relevance
    interfaces: Interfaces

    def problem(self) -> Problem | None:
        """Return what the finding means, None if it does not matter."""
        if not self.known.keeps(self.finding, self.span):
            return None
        if is_parameter(self.finding.kind, self.finding.message):
            return self._made(Family.TYPE, "this is a Parameter, not its value", "add .value")
        if self.finding.kind in _READERS:
            return _READERS[self.finding.kind](self)
        first = self.finding.message.partition("\n")[0]
        if "`None`" in first or "`NoneType`" in first:
            return self._none()
        return self._in_its_words()

    def _made(self, family: Family, message: str, hint: str | None = None) -> Problem:
        return Problem(family, message, self.span, hint)

    def _in_its_words(self, family: Family | None = None, hint: str | None = None) -> Problem:
        text = _plain(self.finding.message.partition("\n")[0]).replace("`", "'")
        family = family or _FAMILIES.get(self.finding.kind, Family.TYPE)
        return self._made(family, text[:1].lower() + text[1:], hint)

    def _import(self) -> Problem | None:
        node = self.known.code.import_at(self.span.line)
        if node is None:
            return None
        module, source = self.known.code.module, self.known.file.source
        imports = Imports(self.span, module, source, self.interfaces)
        found = re.search(_NO_MODULE_ATTRIBUTE, self.finding.message)
        wanted = found["imported"] if found is not None else node.names[0].name
        if isinstance(node, ast.Import):
            return imports.missing_module(self.span.text.split()[0], "")
        missing = imports.missing_module if found is None else imports.missing_name
        return missing("." * node.level + (node.module or ""), wanted)

    def _attribute(self) -> Problem | None:
        in_module = re.search(_NO_MODULE_ATTRIBUTE, self.finding.message)
        if in_module is not None:
            return self._module_attribute(in_module)
        found = list(NO_ATTRIBUTE.finditer(self.finding.message))
        if not found:
            return self._in_its_words()
        named, name = found[-1]["owner"], found[-1]["name"]
        if {item["owner"] for item in found} == {"NoneType"}:
            return self._none()
        if named == "Coroutine":
            value = self.span.text.rpartition(f".{name}")[0]
            message = f"'{value}' is a coroutine, not its result"
            return self._made(Family.AWAIT, message, "write 'await' before the call")
        node = self.known.code.expression_at(self.span)
        module = self.known.code.module
        is_own = named in module.classes
        with_api = not self.known.is_class
        owner = None if is_own else self.known.owners.named(named, module, with_api=with_api)
        at = self.span.text.rfind(name)
        self.span = self.span.part(max(at, 0), len(name))
        meant = _meant(self.finding.message)
        if owner is not None:
            return self._in_its_words(owner.family, owner.hint(name) or meant)
        is_stored = isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
        if is_stored and not is_own:
            return None  # most objects take any attribute
        names = API_NAMES["Behavior"] if is_own and with_api else ()
        return self._in_its_words(hint=meant or suggestion(name, names, limit=0))

    def _module_attribute(self, found: re.Match[str]) -> Problem | None:
        name, module = found["name"] or found["imported"], found["module"]
        top = module.partition(".")[0]
        is_known = top in sys.stdlib_module_names or top in _COMPLETE_MODULES
        if found["imported"] and not is_known:
            return self._import()
        own = {item.path.stem for item in self.known.file.source.own_modules}
        if not (is_known or top in self.interfaces.packages() or module in own):
            return None  # part of it may be compiled
        at = self.span.text.rfind(name)
        self.span = self.span.part(max(at, 0), len(name))
        family = Family.IMPORT if found["imported"] else Family.ATTRIBUTE
        names = dir(sys.modules[module]) if is_known and module in sys.modules else ()
        return self._in_its_words(family, suggestion(name, names, limit=0))

    def _argument(self) -> Problem | None:
        found = ARGUMENT.search(self.finding.message)
        if found is None or found["function"] is None:
            return self._in_its_words()
        given, expected, function = found["given"], found["expected"], found["function"]
        if _may_be_none(given, expected):
            return self._none()
        hint = _part_hint(expected, given)
        if found["name"] != "on_feedback" and re.fullmatch(_SENDING, function):
            return self._in_its_words(Family.MESSAGE_TYPE, hint)
        if expected.startswith("Float") and _plain(given).lstrip("-").isdigit():
            hint = f"write {_plain(given)}.0"
        is_field = re.fullmatch(_OF_MESSAGE, function) is not None
        return self._in_its_words(Family.VALUE if is_field else Family.ARGUMENTS, hint)

    def _keyword(self) -> Problem:
        called = re.search(
            rf"Unexpected keyword argument `(\w+)` in function `{_OF_MESSAGE}`",
            self.finding.message,
        )
        homes = self.known.owners.members.get(called[4], {}) if called is not None else {}
        members = homes.get(f"{called[2]}.{called[3]}") if called is not None else None
        if called is None or members is None:
            return self._in_its_words()
        return self._in_its_words(Family.FIELD, Owner(Family.FIELD, members).hint(called[1]))

    def _name(self) -> Problem | None:
        name = self.span.text
        if name == "self" and self.known.code.class_at(self.span.line) is not None:
            return self._missing_self()
        if name in sys.stdlib_module_names:
            hint = f"add 'import {name}'"
        elif name in API_NAMES:
            hint = f"add 'from composer.behavior import {name}'"
        else:
            hint = _meant(self.finding.message) or "import it, or define it"
        return self._in_its_words(hint=hint)

    def _missing_self(self) -> Problem | None:
        """Return the problem of a method without arguments, or without the 'self' that it uses."""
        code, line = self.known.code, self.span.line
        class_, function = code.class_at(line), code.function_at(line)
        if class_ is None or function is None or function.name in code.names:
            return None  # a plain function, which the body of the class uses
        names = ("self", *(item.arg for item in positional_arguments(function)))
        self.span = name_span(function, "def", self.span.file)
        message = f"method '{function.name}' of '{class_.name}' lacks 'self'"
        return self._made(Family.SELF, message, f"write 'def {function.name}({', '.join(names)})'")

    def _await(self) -> Problem:
        called = self.span.text.partition("(")[0].strip()
        message = f"'{called}' is asynchronous and has no effect without 'await'"
        return self._made(Family.AWAIT, message, f"write 'await {called}(...)'")

    def _return(self) -> Problem | None:
        found = re.search(_ASSIGNMENT, self.finding.message)
        function = self.known.code.function_at(self.span.line)
        if self.finding.message.endswith(MISSING_RETURN) and function is not None:
            return self._missing_return(function)
        if found is None or "Falsy" in found["given"]:
            return None if found is not None else self._in_its_words()
        if _may_be_none(found["given"], found["expected"]):
            return self._none()
        return self._in_its_words(hint=_part_hint(found["expected"], found["given"]))

    def _missing_return(self, function: Function) -> Problem | None:
        is_open = function.returns is None or is_none(function.returns)
        expected = self.finding.message.split("`")[1]
        if expected.endswith("Result") and not self.known.is_class and is_open:
            return None  # the composer sends an empty result
        self.span = name_span(function, "def", self.span.file)
        return self._in_its_words()

    def _none(self) -> Problem | None:
        """Return the problem of a value that may be None, unless the class checks it elsewhere."""
        if self.known.is_class:
            return None  # in what order rclpy calls a class is not known
        name = unguarded_value(self.known.code, self.span, self.finding.message)
        if name is None:
            return None
        message = f"'{name}' may be None here"
        if name.startswith("self."):
            message = f"'{name}' is None until another callback has set it"
        hint = f"check 'if {name} is None' first"
        return Problem(Family.NONE, message, self.span, hint, is_certain=False)


_READERS = {
    "bad-argument-type": Reader._argument,
    "bad-function-definition": Reader._missing_self,
    "bad-return": Reader._return,
    "missing-attribute": Reader._attribute,
    "missing-import": Reader._import,
    "missing-module-attribute": Reader._attribute,
    "unexpected-keyword": Reader._keyword,
    "unknown-name": Reader._name,
    "unused-coroutine": Reader._await,
}


def _meant(message: str) -> str | None:
    """Return the hint of the checker."""
    found = re.search(_MEANT, message)
    return f"did you mean '{found[1]}'?" if found is not None else None


def _plain(text: str) -> str:
    """Return a type as a reader knows it."""
    literals = re.sub(_LITERAL, lambda found: found[1].replace("'", '"'), text)
    text = re.sub(_MODULE, "", literals).replace("ReturnType", "Return")
    text = text.replace("Float | Scalar", "float").replace("Values[", "list[")
    return text.replace(": Unknown", "")


def _may_be_none(given: str, expected: str) -> bool:
    """Return whether a value has the right type, or is None."""
    members = [] if given.startswith("(") else given.split(" | ")
    others = {item.rpartition(".")[2] for item in members if item != "None"}
    is_plain = all(item.isidentifier() for item in (*others, expected.rpartition(".")[2]))
    is_other = is_plain and expected.rpartition(".")[2] not in others | {"float", "Any"}
    return "None" in members and len(members) > 1 and not (is_other and "Unknown" not in others)


def _part_hint(expected: str, given: str) -> str | None:
    """Return a hint if the class was meant instead of an object, or one part for another."""
    if given == f"type[{expected}]":
        return "create an object: add '()'"
    short, wanted = given.rpartition(".")[2], re.split(r"\W", expected)[-1]
    if short == wanted and short in ("Time", "Duration"):
        return "add '.to_msg()'"
    base, _, part = expected.rpartition("_")
    return f"use '{base}.{part}'" if base and given.startswith(base) else None
