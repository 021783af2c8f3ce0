"""Which findings of the type checker point to a mistake, and which only to loose typing.

Code that runs today has wrong annotations, attributes that change their kind, and values whose
type depends on a condition. A finding that follows from one of these is left out. In rclpy classes,
which run today, only findings about ROS and those that no annotation can cause are kept.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Container, Iterable

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.python_code.checker.code_index import CodeIndex
from composer.python_code.checker.pyrefly import Finding
from composer.python_code.trees import dotted, is_none

#: Kinds that are certain in any class, whatever the annotations say.
_CERTAIN_KINDS = frozenset(
    {"bad-argument-count", "bad-raise", "missing-argument", "missing-module-attribute"}
    | {"not-callable", "unexpected-keyword", "unknown-name", "unused-coroutine"}
)
#: Kinds that are kept in any code.
_ALWAYS = frozenset({"invalid-syntax", "missing-import", "missing-module-attribute", "parse-error"})
#: Kinds that are kept in classes if they are about a type of ROS.
_KINDS_ABOUT_TYPES = frozenset(
    {"bad-argument-type", "bad-index", "not-async", "not-iterable", "unsupported-operation"}
)
#: What happens to a parameter whose value is meant.
_USES_OF_PARAMETERS = frozenset(
    {"bad-assignment", "implicit-bool", "invalid-format-spec", "unsupported-operation"}
)
_NUMPY = r"\b(?:(?:ndarray|dtype|numpy|(?:un)?signedinteger|floating|bool_)\b|generic\[)"
_ROS = (
    r"in function `(?:rclpy|composer|\w+\.(?:msg|srv|action))\."
    r"|`(?:Time|Duration|Parameter|Future\[|Client\[|Publisher\[|rclpy\.)"
    r"|between `Literal\['[^`]*` and `(?:int|float)`"
)
_RESULT_FOR_RCLPY = r" return (?:type )?`[\w.]*(?:_Response|Result|CallbackReturnType)`"
_BUILTINS = frozenset(
    {"Enum", "bool", "bytes", "dict", "float", "int", "list", "object", "set", "str", "tuple"}
)
_GIVEN = (
    r"Argument `(?P<given>.+?)` is not assignable to parameter"
    r"(?: `\w+`)?(?: with type `(?P<expected>[^`]*)`)?"
)
_OWNER = r"(?:Object of class|Class) `(?P<owner>[\w.@]+)` has no (?:class )?attribute"


@dataclass(frozen=True, slots=True)
class Relevance:
    """Decides about the findings in one file.

    ``reassigned`` are the names and own attributes that get values of several types, ``attributes``
    those that any class of the project defines, ``classes`` their names, ``messages`` the messages
    of ROS.
    """

    code: CodeIndex
    is_class: bool  # an rclpy class, in contrast to a behavior
    reassigned: frozenset[str]
    attributes: frozenset[str]
    classes: frozenset[str]
    messages: Container[str]

    def keeps(self, finding: Finding, span: Span) -> bool:
        """Return whether a finding points to a mistake."""
        kind, message = finding.kind, finding.message
        if kind == "unknown-name":
            # Names after 'global' may be set later, annotations of attributes are not evaluated.
            # Names that the syntax does not have are in annotations that are texts.
            line = span.file.line(span.line)
            is_used = re.match(r"\s*(global |nonlocal |self\.\w+\s*:)", line) is None
            return is_used and span.text in self.code.names
        if is_parameter(kind, message):
            statements = (statement for _, statement in self.code.assigned_at(span.line))
            is_declared = any(isinstance(item, ast.AnnAssign) for item in statements)
            return self.is_class and (kind != "bad-assignment" or is_declared)
        if kind in _ALWAYS or message.startswith(("No attribute", "Instance method")):
            return True
        return not self._is_loose_code(message, span) and self._is_kept(kind, message, span)

    def _is_loose_code(self, message: str, span: Span) -> bool:
        """Return whether the code is such that a finding in its line says little."""
        if re.search(_NUMPY, message) or self.code.is_guarded(span.line):
            return True
        is_reassigned = not self.reassigned.isdisjoint(re.findall(r"\w+", span.text))
        return is_reassigned or self.code.has_loose_names(span.line)

    def _is_kept(self, kind: str, message: str, span: Span) -> bool:
        if kind in ("implicit-bool", "bad-function-definition"):
            return False
        if kind == "unbound-name":
            return not self.is_class and "may be" not in message
        if kind == "bad-return" and self.is_class:  # other annotations may be wrong
            return re.search(_RESULT_FOR_RCLPY, message) is not None
        node = self.code.expression_at(span)
        if kind == "missing-attribute":
            return self._keeps_attribute(message, node)
        given = re.search(_GIVEN, message) if kind == "bad-argument-type" else None
        is_ros = re.search(_ROS, message) is not None
        if given is not None and self._is_loose(given, node, is_ros=is_ros):
            return False
        if not self.is_class or kind in _CERTAIN_KINDS or kind == "bad-assignment":
            return True
        if given is not None:
            is_message = self._is_message(given["given"])
        else:
            is_message = self._is_about_message(message, node)
        return kind in _KINDS_ABOUT_TYPES and (is_ros or is_message)

    def _keeps_attribute(self, message: str, node: ast.expr | None) -> bool:
        owner = re.search(_OWNER, message)
        name = owner["owner"] if owner is not None else ""
        if name == "property":
            return False  # of a class instead of a message, which is reported where it is sent
        if isinstance(node, ast.Attribute):
            if dotted(node.value) in self.code.tested - {"", "self"}:
                return False  # its class may depend on the version of a package
            if node.attr.startswith("_") and not node.attr.startswith("__"):
                return name in self.classes and node.attr not in self.attributes
            if name in self.classes or name.startswith("Self@"):
                changed = (item for _, item in self.code.assigned_at(node.lineno))
                is_changed = any(isinstance(item, ast.AugAssign) for item in changed)
                is_read = isinstance(node.ctx, ast.Load) or is_changed
                is_defined = node.attr in self.attributes or self.code.sets_computed_names
                return is_read and not is_defined
            if name in _BUILTINS and isinstance(node.value, ast.Subscript):
                return False  # one of the values of a mixed dict or list
        if not self.is_class or name not in _BUILTINS | {"NoneType"}:
            return True
        value = node.value if isinstance(node, ast.Attribute) else None
        is_field = isinstance(value, ast.Attribute) and value.attr not in self.attributes
        return is_field and name != "NoneType"

    def _is_loose(self, match: re.Match[str], node: ast.expr | None, *, is_ros: bool) -> bool:
        """Return whether the value of an argument may have the right type after all."""
        given, expected = match["given"], match["expected"] or ""
        if given.startswith("(") and (is_ros or expected.startswith("(")):
            # Annotations of functions are often loose, the number of arguments never is.
            return not is_ros and _arity(given) in (_arity(expected), None)
        if self.is_class and "Unknown" in given and not given.startswith("Coroutine["):
            return True
        types = re.sub(r"\bLiteral\[-?\d+\]", "int", given).split(" | ")
        members = {*types} - {"Any", "Unknown"}
        if len(members) > 1 and "None" not in members:
            return True
        if node is None:
            return False
        if given == "int" and isinstance(node, ast.Subscript):
            return True  # an element of a list that got other values later
        return self.is_class and given not in _BUILTINS and self._is_annotated_argument(node)

    def _is_about_message(self, text: str, node: ast.expr | None) -> bool:
        """Return whether a value is certainly a message, and not just annotated as one."""
        parts = () if node is None else ast.walk(node)
        values = [part for part in parts if isinstance(part, ast.expr)]
        if not values or any(map(self._is_annotated_argument, values)):
            return False
        return any(map(self._is_message, re.findall(r"`(\w+)`", text)))

    def _is_message(self, name: str) -> bool:
        return name in self.messages and name not in self.classes

    def _is_annotated_argument(self, node: ast.expr) -> bool:
        """Return whether a value is an argument, or stores one, whose annotation may be wrong."""
        name = dotted(node)
        values = self.code.values_of(name, node.lineno) if name.startswith("self.") else ()
        used = {name, *(dotted(value) for value in values)}
        return not self.code.annotated_arguments.isdisjoint(used)


def reassigned(code: CodeIndex, lines: Iterable[int]) -> frozenset[str]:
    """Return the names and own attributes that get values of several types in ``lines``."""
    targets = (dotted(target) for line in lines for target, _ in code.assigned_at(line))
    names = (name.removeprefix("self.") for name in targets)
    return frozenset(name for name in names if name and "." not in name)


def is_parameter(kind: str, message: str) -> bool:
    """Return whether a parameter of rclpy is in the place of its value."""
    return kind in _USES_OF_PARAMETERS and "`Parameter`" in message


def _arity(function: str) -> int | None:
    """Return how many arguments a function takes: 2 for ``(int, list[int]) -> int``."""
    depth, count = 0, 0
    inside = function[1 : function.find(") -> ")]
    if re.search(r"[=*]|\.\.\.", inside):
        return None
    for letter in inside:
        depth += (letter in "([") - (letter in ")]")
        count += letter == "," and depth == 0
    return count + bool(inside)


_STARTS = frozenset({"__init__", "on_configure", "on_activate"})
_LONGEST = 60  # characters of an expression in a message


def unguarded_value(code: CodeIndex, span: Span, message: str) -> str | None:
    """Return the value at a place that may be None as it is written, None if it is checked.

    The type checker forgets at each call what another method has checked. So an attribute counts
    as checked if any method of its class compares it, tests it or stores it elsewhere, and as set
    if a transition or the constructor gives it a value.
    """
    node = code.expression_at(span)
    if node is None:
        return None
    match node:
        case ast.Attribute(value=value) | ast.Subscript(value=value) if dotted(value) != "self":
            node = value
        case ast.BinOp(left=left, right=right):
            node = right if re.search(r" and `[^`]*None[^`]*`", message) else left
        case ast.Call(func=value) if "callable" in message:
            node = value
    name = dotted(node)
    function, class_ = code.function_at(span.line), code.class_at(span.line)
    if not name.startswith("self."):
        is_checked = bool(name) and function is not None and code.is_checked(function, name)
        return None if is_checked else ast.unparse(node)[:_LONGEST]
    name = ".".join(name.split(".")[:2])
    if class_ is None or code.is_checked(class_, name):
        return None
    values = (
        value
        for value in code.values_of(name, span.line)
        if getattr(code.function_at(value.lineno), "name", "") in _STARTS
    )
    return name if all(map(is_none, values)) else None
