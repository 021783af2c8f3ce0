"""Which findings of the type checker point to a mistake, and which only to loose typing.

Code that runs today has wrong annotations, attributes that change their kind, and values whose
type depends on a condition. A finding that follows from one of these is left out. In rclpy classes,
which run today, only findings about ROS and those that no annotation can cause are kept.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.python_code.checker.code_index import CodeIndex
from composer.python_code.checker.file_sets import CheckedFile
from composer.python_code.checker.owners import Owners
from composer.python_code.checker.pyrefly import Finding
from composer.python_code.trees import bindings, dotted, is_none, last_name

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
ARGUMENT = re.compile(
    r"Argument `(?P<given>.+?)` is not assignable to parameter(?: `(?P<name>\w+)`)?"
    r"(?: with type `(?P<expected>[^`]*)`)?(?: in function `(?P<function>[\w.<>]+)`)?"
)
#: The name that gets a value of another type than before.
_CHANGED = re.compile(r"is not assignable to (?:variable|attribute) `(\w+)`")
NO_ATTRIBUTE = re.compile(
    r"(?:Object of class|Class) `(?P<owner>[\w.@]+)` has no (?:class )?attribute `(?P<name>\w+)`"
)


@dataclass(frozen=True, slots=True)
class Relevance:
    """Decides about the findings in one file.

    ``changed`` are the names that get values of several types, ``attributes`` all attributes that
    classes of the project define, ``classes`` the names of these classes.
    """

    code: CodeIndex
    file: CheckedFile
    owners: Owners
    changed: frozenset[str]
    attributes: frozenset[str]
    classes: frozenset[str]

    @property
    def is_class(self) -> bool:
        """Whether it is an rclpy class, in contrast to a behavior."""
        return self.file.node.behavior is None

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
            return self.is_class and "to variable `" not in message
        if kind in _ALWAYS or message.startswith(("No attribute", "Instance method")):
            return True
        return not self._is_loose_code(message, span) and self._is_kept(kind, message, span)

    def _is_loose_code(self, message: str, span: Span) -> bool:
        """Return whether the code is such that a finding in its line says little."""
        if re.search(_NUMPY, message) or self.code.is_guarded(span.line):
            return True
        is_changed = not self.changed.isdisjoint(re.findall(r"\w+", span.text))
        return is_changed or self.code.has_loose_names(span.line)

    def _is_kept(self, kind: str, message: str, span: Span) -> bool:
        if kind in ("bad-function-definition", "implicit-bool"):
            return False
        if kind == "bad-assignment":  # without an annotation, a variable may change its kind
            return not (self.is_class or _CHANGED.search(message))
        if kind == "bad-return" and self.is_class:  # other annotations may be wrong
            return re.search(_RESULT_FOR_RCLPY, message) is not None
        node = self.code.expression_at(span)
        if kind == "missing-attribute":
            return self._keeps_attribute(message, node)
        is_ros = re.search(_ROS, message) is not None
        given = ARGUMENT.search(message) if kind == "bad-argument-type" else None
        if given is not None and self._is_loose(given, node, is_ros=is_ros):
            return False
        named = [given["given"]] if given is not None else re.findall(r"`(\w+)`", message)
        is_message = any(name in self.owners.members and name not in self.classes for name in named)
        return not self.is_class or kind in _CERTAIN_KINDS or is_ros or is_message

    def _keeps_attribute(self, message: str, node: ast.expr | None) -> bool:
        if "hasattr" in self.code.names:
            return False  # the attribute may depend on the version of a package
        owner = NO_ATTRIBUTE.search(message)
        name = owner["owner"] if owner is not None else ""
        value = node.value if isinstance(node, ast.Attribute) else None
        if isinstance(node, ast.Attribute) and (name in self.classes or name.startswith("Self@")):
            around = self.code.around(node.lineno)
            is_changed = any(isinstance(item, ast.AugAssign) for item in around)
            is_read = isinstance(node.ctx, ast.Load) or is_changed
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
        if not self.is_class or given in _BUILTINS or node is None:
            return False
        # Annotations of arguments, and of attributes that store them, may be wrong.
        return last_name(node).strip("_") in self.code.annotated_arguments


def is_parameter(kind: str, message: str) -> bool:
    """Return whether a parameter of rclpy is in the place of its value."""
    return kind in _USES_OF_PARAMETERS and "`Parameter`" in message


def changed_names(findings: Iterable[Finding]) -> frozenset[str]:
    """Return the variables and attributes that get values of several types."""
    found = (_CHANGED.search(x.message) for x in findings if x.kind == "bad-assignment")
    return frozenset(match[1] for match in found if match is not None)


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
    if not is_own or not isinstance(scope, ast.ClassDef):
        return ast.unparse(node)[:_LONGEST] if not is_own else None
    starts = (item for item in scope.body if getattr(item, "name", "") in _STARTS)
    values = (value for start in starts for value in bindings(start).get(name, ()))
    return name if all(map(is_none, values)) else None
