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
from composer.python_code.trees import dotted, is_none, last_name

#: Kinds that are certain in any class, whatever the annotations say.
_CERTAIN_KINDS = frozenset(
    {"bad-argument-count", "bad-raise", "missing-argument", "not-callable", "unexpected-keyword"}
    | {"unused-coroutine"}
)
#: Kinds that are kept in any code.
_ALWAYS = frozenset({"invalid-syntax", "missing-import", "missing-module-attribute", "parse-error"})
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
    all attributes that classes of the project define, ``classes`` the names of these classes, and
    ``messages`` the messages of ROS.
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
            is_declared = isinstance(self.code.assignment_at(span.line), ast.AnnAssign)
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
        if kind in ("bad-function-definition", "implicit-bool"):
            return False
        if kind == "bad-assignment":  # without an annotation, a variable may change its kind
            statement = self.code.assignment_at(span.line)
            target = statement.target if isinstance(statement, ast.AnnAssign) else None
            return isinstance(target, ast.Name) and not self.is_class
        if kind == "bad-return" and self.is_class:  # other annotations may be wrong
            return re.search(_RESULT_FOR_RCLPY, message) is not None
        node = self.code.expression_at(span)
        if kind == "missing-attribute":
            return self._keeps_attribute(message, node)
        is_ros = re.search(_ROS, message) is not None
        given = re.search(_GIVEN, message) if kind == "bad-argument-type" else None
        if given is not None and self._is_loose(given, node, is_ros=is_ros):
            return False
        named = [given["given"]] if given is not None else re.findall(r"`(\w+)`", message)
        is_message = any(name in self.messages and name not in self.classes for name in named)
        return not self.is_class or kind in _CERTAIN_KINDS or is_ros or is_message

    def _keeps_attribute(self, message: str, node: ast.expr | None) -> bool:
        owner = re.search(_OWNER, message)
        name = owner["owner"] if owner is not None else ""
        value = node.value if isinstance(node, ast.Attribute) else None
        if isinstance(node, ast.Attribute) and (name in self.classes or name.startswith("Self@")):
            changed = self.code.assignment_at(node.lineno)
            is_read = isinstance(node.ctx, ast.Load) or isinstance(changed, ast.AugAssign)
            is_defined = node.attr in self.attributes or self.code.sets_computed_names
            return is_read and not is_defined
        if name in ("property", "NoneType") and (self.is_class or name == "property"):
            return False  # a property of a class is reported where the class is sent
        if name not in _BUILTINS:
            return not isinstance(node, ast.Attribute) or node.attr[:1] != "_"
        is_field = isinstance(value, ast.Attribute) and value.attr not in self.attributes
        return is_field if self.is_class else not isinstance(value, ast.Subscript)

    def _is_loose(self, match: re.Match[str], node: ast.expr | None, *, is_ros: bool) -> bool:
        """Return whether the value of an argument may have the right type after all."""
        given, expected = match["given"], match["expected"] or ""
        if given.startswith("(") and expected.startswith("("):  # which are often annotated loosely
            return not is_ros
        if self.is_class and "Unknown" in given and not given.startswith("Coroutine["):
            return True
        types = re.sub(r"\bLiteral\[-?\d+\]", "int", given).split(" | ")
        members = {*types} - {"Any", "Unknown"}
        if len(members) > 1 and "None" not in members:
            return True
        if given == "int" and isinstance(node, ast.Subscript):
            return True  # an element of a list that got other values later
        if not self.is_class or given in _BUILTINS or node is None:
            return False
        # Annotations of arguments, and of attributes that store them, may be wrong.
        return last_name(node).strip("_") in self.code.annotated_arguments


def reassigned(code: CodeIndex, lines: Iterable[int]) -> frozenset[str]:
    """Return the names and own attributes that get values of several types in ``lines``."""
    nodes = filter(None, (code.assignment_at(line) for line in lines))
    targets = (x for node in nodes for x in ast.walk(node) if hasattr(x, "ctx"))
    names = (dotted(x).removeprefix("self.") for x in targets if isinstance(x.ctx, ast.Store))
    return frozenset(name for name in names if name and "." not in name)


def is_parameter(kind: str, message: str) -> bool:
    """Return whether a parameter of rclpy is in the place of its value."""
    return kind in _USES_OF_PARAMETERS and "`Parameter`" in message


_STARTS = frozenset({"__init__", "on_configure", "on_activate"})
_LONGEST = 60  # characters of an expression in a message


def unguarded_value(code: CodeIndex, span: Span, message: str) -> str | None:
    """Return the value at a place that may be None as it is written, None if it is checked.

    The type checker forgets at each call what another method has checked. So an attribute counts
    as checked if any method of its class compares it, tests it or stores it elsewhere, and as set
    if a transition or the constructor gives it a value.
    """
    node = code.expression_at(span)
    match node:
        case None:
            return None
        case ast.Attribute(value=value) | ast.Subscript(value=value) if dotted(value) != "self":
            node = value
        case ast.BinOp(left=left, right=right):
            node = right if re.search(r" and `[^`]*None[^`]*`", message) else left
        case ast.Call(func=value) if "callable" in message:
            node = value
    name = dotted(node)
    is_own = name.startswith("self.")
    name = ".".join(name.split(".")[:2]) if is_own else name
    scope = code.class_at(span.line) if is_own else code.function_at(span.line)
    if scope is not None and name and code.is_checked(scope, name):
        return None
    if not is_own:
        return ast.unparse(node)[:_LONGEST]
    functions = {x: code.function_at(x.lineno) for x in code.values_of(name, span.line)}
    values = (x for x, function in functions.items() if getattr(function, "name", "") in _STARTS)
    return name if scope is not None and all(map(is_none, values)) else None
