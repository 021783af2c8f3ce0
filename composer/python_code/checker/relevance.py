"""Which findings of the type checker point to a mistake, and which only to loose typing.

Code that runs today has wrong annotations, attributes that change their kind, and values whose
type depends on a condition. A finding that follows from one of these is left out. In rclpy classes,
which run today, only findings about ROS and those that no annotation can cause are kept.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.python_code.checker.file_sets import CheckedFile
from composer.python_code.checker.imports import Owners
from composer.python_code.checker.pyrefly import Finding
from composer.python_code.syntax import Module
from composer.python_code.trees import (
    Function,
    bindings,
    called_name,
    catches,
    dotted,
    is_none,
    last_name,
    span_of,
)

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
_STARTS = frozenset({"__init__", "on_configure", "on_activate"})
_LONGEST = 60  # characters of an expression in a message
#: Statements whose code may be left out, or may fail.
_CONDITIONAL = (ast.If, ast.Match, ast.Try, ast.With)
#: Code that uses a value without looking at it.
_USES = (ast.Attribute, ast.BinOp, ast.Call, ast.FormattedValue, ast.Subscript, ast.keyword)
#: What code raises that uses a value of a wrong type.
_ERRORS = frozenset({"AttributeError", "NameError", "TypeError"})


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


class CodeIndex:
    """The parts of a file: statements by line, and names. The file is walked once."""

    def __init__(self, module: Module) -> None:
        self.module = module
        self._nodes = tuple(ast.walk(module.tree))
        self._places: dict[int, dict[Span, ast.expr]] = {}  # by line
        self._checked: dict[ast.AST, frozenset[str]] = {}  # by class or function
        self._made: dict[tuple[str, ast.AST], frozenset[str]] = {}  # by name and its scope

    @cached_property
    def names(self) -> frozenset[str]:
        """The names in the code, without those in texts."""
        names = {node.id for node in self._nodes if isinstance(node, ast.Name)}
        return frozenset(names | {node.arg for node in self._nodes if isinstance(node, ast.arg)})

    @cached_property
    def annotated_arguments(self) -> frozenset[str]:
        """Arguments with an annotation, of functions that no call passes on to rclpy."""
        calls = [node for node in self._nodes if isinstance(node, ast.Call)]
        passed = {dotted(value) for call in calls for value in call.args}
        passed |= {dotted(item.value) for call in calls for item in call.keywords}
        functions = (node for node in self._nodes if isinstance(node, Function))
        own = (item for item in functions if f"self.{item.name}" not in passed)
        arguments = (x for item in own for x in ast.walk(item.args) if isinstance(x, ast.arg))
        return frozenset(item.arg for item in arguments if item.annotation is not None)

    def around(self, line: int) -> Iterator[ast.stmt]:
        """Yield the statements that contain a line, from the inside to the outside."""
        return reversed(self._statements.get(line, ()))

    @cached_property
    def _statements(self) -> Mapping[int, Sequence[ast.stmt]]:
        found: dict[int, list[ast.stmt]] = {}
        for node in self._nodes:
            if isinstance(node, ast.stmt):
                for line in range(node.lineno, (node.end_lineno or node.lineno) + 1):
                    found.setdefault(line, []).append(node)
        return found

    def import_at(self, line: int) -> ast.Import | ast.ImportFrom | None:
        """Return the import in a line; None in a ``try`` or the like, where it may fail."""
        if any(isinstance(node, _CONDITIONAL) for node in self.around(line)):
            return None
        imports = (x for x in self.around(line) if isinstance(x, ast.Import | ast.ImportFrom))
        return next(imports, None)

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function that contains a line."""
        return next((node for node in self.around(line) if isinstance(node, Function)), None)

    def class_at(self, line: int) -> ast.ClassDef | None:
        """Return the innermost class that contains a line."""
        return next((node for node in self.around(line) if isinstance(node, ast.ClassDef)), None)

    def expression_at(self, span: Span) -> ast.expr | None:
        """Return the outermost expression at a place."""
        if span.line not in self._places:
            places = self._places[span.line] = {}
            for node in self._expressions.get(span.line, ()):
                places.setdefault(span_of(node, span.file), node)
        return self._places[span.line].get(span)

    @cached_property
    def _expressions(self) -> Mapping[int, list[ast.expr]]:
        found: dict[int, list[ast.expr]] = {}
        for node in self._nodes:
            if isinstance(node, ast.expr):
                found.setdefault(node.lineno, []).append(node)
        return found

    def has_loose_names(self, line: int) -> bool:
        """Return whether a line uses a name that gets objects of different classes.

        Which one it has may depend on a condition, such as the distribution of ROS.
        """
        alternatives = self.module.alternatives.keys()
        for name in filter(None, map(dotted, self._expressions.get(line, ()))):
            place = self.class_at(line) if "." in name else self.function_at(line)
            key = name, place or self.module.tree
            if key not in self._made:
                values = filter(None, bindings(key[1]).get(name, ()))
                self._made[key] = frozenset(map(_made_class, values)) - {""}
            made = self._made[key]
            if len(made) > 1 or made & alternatives or name.partition(".")[0] in alternatives:
                return True
        return False

    def is_guarded(self, line: int) -> bool:
        """Return whether the code around a line catches what the lack of an attribute raises.

        Which attributes an object has may depend on the version of a package.
        """
        attempts = (node for node in self.around(line) if isinstance(node, ast.Try))
        return any(catches(handler, _ERRORS) for node in attempts for handler in node.handlers)

    def is_checked(self, scope: ast.AST, name: str) -> bool:
        """Return whether a class or function compares a value, tests it or stores it elsewhere."""
        if scope not in self._checked:
            self._checked[scope] = frozenset(map(dotted, _checks_in(scope)))
        return name in self._checked[scope]

    def attributes_set(self) -> Iterator[str]:
        """Yield the methods and attributes that the code defines, of any object."""
        changed = {node.target for node in self._nodes if isinstance(node, ast.AugAssign)}
        for node in self._nodes:
            if isinstance(node, ast.Attribute) and node not in changed:
                yield from (node.attr,) if isinstance(node.ctx, ast.Store) else ()
            for statement in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(statement, Function | ast.ClassDef):
                    yield statement.name
                elif isinstance(statement, ast.Assign | ast.AnnAssign):
                    yield from (x.id for x in ast.walk(statement) if isinstance(x, ast.Name))

    @property
    def sets_computed_names(self) -> bool:
        """Whether the file sets attributes by name, so that any may exist."""
        return bool({"setattr", "vars"} & self.names) or "__dict__" in self.module.source.text


def _made_class(value: ast.expr) -> str:
    """Return the class of which a call makes an object, or the type of a port; else ""."""
    if not isinstance(value, ast.Call):
        return ""
    is_port = called_name(value).startswith("create_") and value.args
    name = last_name(value.args[0] if is_port else value.func)
    return name if name[:1].isupper() else ""


def _checks_in(scope: ast.AST) -> Iterator[ast.AST]:
    """Yield the expressions that code compares, tests, stores or returns: not only uses."""
    for node in ast.walk(scope):
        if not isinstance(node, _USES):
            parts = (x for x in ast.iter_child_nodes(node) if isinstance(x, ast.expr))
            yield from (x for x in parts if not isinstance(getattr(x, "ctx", None), ast.Store))
