"""Which findings of the type checker point to a mistake, and which only to loose typing.

Code that runs today has wrong annotations, attributes that change their kind, and values whose type
depends on a condition. A finding that follows from one of these is left out. In rclpy classes, which
run today, only findings about ROS and those that no annotation can cause are kept.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from functools import cached_property

from composer.fast_dataclass import dataclass
from composer.python_code.checker.copies import Copy
from composer.python_code.checker.pyrefly import Finding
from composer.python_code.source import Module
from composer.python_code.source.method_body import dotted
from composer.python_code.source.spans import span_of
from composer.source import Span

#: Kinds about annotations and definitions: the code runs as before.
_LOOSE_KINDS = frozenset(
    {
        "attribute-assign-on-never",
        "bad-class-definition",
        "bad-dataclass-descriptor",
        "bad-function-definition",
        "bad-override",
        "bad-override-mutable-attribute",
        "bad-specialization",
        "bad-typed-dict",
        "bad-typed-dict-key",
        "implicit-abstract-class",
        "inconsistent-inheritance",
        "inconsistent-overload",
        "invalid-annotation",
        "invalid-inheritance",
        "invalid-syntax",
        "invalid-type-alias",
        "invalid-type-var",
        "invalid-variance",
        "missing-override-decorator",
        "non-exhaustive-match",
        "not-a-type",
        "parse-error",
        "reveal-type",
        "unexpected-never",
        "unimported-directive",
        "unresolvable-dunder-all",
        "unsafe-overlap",
        "unsupported-dynamic-base",
    }
)
#: Kinds that are certain whatever the annotations say.
_CERTAIN_KINDS = frozenset(
    {
        "bad-argument-count",
        "bad-raise",
        "not-callable",
        "missing-argument",
        "missing-module-attribute",
        "unexpected-keyword",
        "unknown-name",
        "unused-coroutine",
    }
)
#: Kinds that are kept in classes if they are about a type of ROS.
_ABOUT_TYPES = frozenset(
    {
        "bad-argument-type",
        "bad-assignment",
        "bad-index",
        "not-iterable",
        "unsupported-operation",
    }
)
_NUMPY = re.compile(r"\b(?:ndarray|dtype|numpy|(?:un)?signedinteger|floating|bool_|generic\[)")
_OF_ROS = re.compile(
    r"in function `(?:rclpy|\w+\.(?:msg|srv|action))\."
    r"|`(?:Time|Duration|Parameter|Future\[|Client\[|Publisher\[|rclpy\.|Argument `[A-Z]\w+`)"
)
_BUILTINS = frozenset(
    {"bool", "bytes", "dict", "float", "int", "list", "object", "set", "str", "tuple", "Enum"}
)
_GIVEN = re.compile(r"Argument `(?P<given>.+?)` is not assignable to parameter")
_OWNER = re.compile(r"(?:Object of class|Class) `(?P<owner>[\w.@]+)` has no (?:class )?attribute")


@dataclass(slots=True)
class Relevance:
    """What is known about the code of one file, and about all findings in it."""

    module: Module
    is_class: bool  # an rclpy class, in contrast to a behavior
    #: The names and own attributes that get values of several types.
    reassigned: frozenset[str]
    #: The attributes that any class of the project defines.
    defined: frozenset[object]
    facts: _Facts

    @classmethod
    def of(
        cls, copy: Copy, findings: Iterable[Finding], *, is_class: bool, own: Iterable[Module]
    ) -> Relevance:
        """Return what decides about the findings in a file; ``own`` are the project's modules."""
        facts = _Facts(copy.module)
        lines = {
            copy.place(finding.line, finding.column)[0]
            for finding in findings
            if finding.kind == "bad-assignment"
        }
        defined = frozenset(name for other in own for name in _defined_attributes(other.tree))
        return cls(copy.module, is_class, frozenset(facts.assigned_in(lines)), defined, facts)

    def keeps(self, finding: Finding, span: Span) -> bool:
        """Return whether a finding points to a mistake."""
        kind, message = finding.kind, finding.message
        is_module = message.startswith(("No attribute", "Could not import"))
        is_numpy = _NUMPY.search(message) is not None and kind != "unknown-name"
        if kind in _LOOSE_KINDS or (is_numpy and not is_module):
            return False
        if kind == "unbound-name":
            return not self.is_class and "may be" not in message
        if kind == "unknown-name":
            return not self._is_unevaluated(span)
        if any(word in self.reassigned for word in re.findall(r"\w+", span.text)):
            return False
        if kind == "missing-attribute" and not is_module:
            return self._keeps_attribute(message, span)
        given = _GIVEN.search(message)
        if given is not None and _is_one_of_several(given["given"]):
            return False
        if self.has_several_values(span) or self._is_annotated_argument(span):
            return False
        called = self.facts.called_with.get((span.line, span.column, span.length))
        if called is not None and self._has_several_values(called):
            return False
        if given is not None and given["given"] == "int" and span.text.endswith("]"):
            return False  # an element of a list that got other values later
        if not self.is_class or kind in _CERTAIN_KINDS or is_module:
            return True
        return kind in _ABOUT_TYPES and _OF_ROS.search(message) is not None

    def _keeps_attribute(self, message: str, span: Span) -> bool:
        owner = _OWNER.search(message)
        name = owner["owner"] if owner is not None else ""
        node = self._node_at(span)
        if isinstance(node, ast.Attribute):
            if node.attr.startswith("_") and not node.attr.startswith("__"):
                return False  # fields have such names, too
            if self.has_several_values(span):
                return False
            if name in self.module.classes or name.startswith("Self@"):
                is_stored = not isinstance(node.ctx, ast.Load)
                return node.attr not in self.defined and not is_stored and not self._sets_names
            if name in _BUILTINS and isinstance(node.value, ast.Subscript):
                return False  # one of the values of a mixed dict or list
        if self.is_class:
            return name not in _BUILTINS and name != "NoneType" and not self._is_plain_store(node)
        return True

    def _is_plain_store(self, node: ast.AST | None) -> bool:
        """Return whether an attribute is set, which most objects allow; messages do not."""
        is_stored = isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load)
        return is_stored and dotted(node.value).startswith("server")  # type: ignore[union-attr]

    def has_several_values(self, span: Span) -> bool:
        """Return whether a name in an expression is assigned values of different calls."""
        node = self._node_at(span)
        return node is not None and self._has_several_values(node)

    def _has_several_values(self, node: ast.expr) -> bool:
        for part in ast.walk(node):
            name = dotted(part) if isinstance(part, ast.Attribute | ast.Name) else ""
            if _differ(self.facts.calls_assigned_to(name, node.lineno)):
                return True
        return False

    def _is_annotated_argument(self, span: Span) -> bool:
        """Return whether a value is an argument whose annotation may be wrong."""
        if not self.is_class:
            return False
        return span.text in self.facts.stored_arguments or any(
            span.text == argument.arg and first <= span.line <= last
            for argument, first, last in self.facts.annotated
        )

    def _is_unevaluated(self, span: Span) -> bool:
        """Return whether a name is in an annotation that Python does not evaluate."""
        line = span.file.line(span.line)
        if line.lstrip().startswith(("global ", "nonlocal ")):
            return True
        return any(
            node.lineno <= span.line <= (node.end_lineno or node.lineno)
            and span.column > node.col_offset
            and span.column <= (node.end_col_offset or 0) + 1
            for node in self.facts.unevaluated
        )

    @property
    def _sets_names(self) -> bool:
        return self.facts.sets_names

    def _node_at(self, span: Span) -> ast.AST | None:
        return self.facts.by_place.get((span.line, span.column, span.length))


class _Facts:
    """The syntax of one file, by what findings need to know."""

    def __init__(self, module: Module) -> None:
        self.module = module

    @cached_property
    def by_place(self) -> dict[tuple[int, int, int], ast.AST]:
        """The expressions of one line by line, column and length; the outermost of equal ones."""
        places: dict[tuple[int, int, int], ast.AST] = {}
        for node in ast.walk(self.module.tree):
            if isinstance(node, ast.expr):
                span = span_of(node, self.module.source)
                places.setdefault((span.line, span.column, span.length), node)
        return places

    def assigned_in(self, lines: Collection[int]) -> Iterator[str]:
        """Yield the local names and own attributes that the given lines assign."""
        for node in ast.walk(self.module.tree):
            if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign) and node.lineno in lines:
                for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                    name = dotted(target)
                    if "." not in name.removeprefix("self."):
                        yield name.removeprefix("self.")

    def calls_assigned_to(self, name: str, line: int) -> set[str]:
        """Return the calls whose values a name gets where a line sees it, with what they take."""
        scopes = self.functions if "." not in name else self.classes
        around = [scope for scope in scopes if scope[0] <= line <= scope[1]]
        first, last = max(around, default=(0, 2**31))
        return {text for at, text in self.values.get(name, ()) if first <= at <= last}

    @cached_property
    def functions(self) -> list[tuple[int, int]]:
        """The first and last line of each function."""
        return list(_lines(self.module.tree, ast.FunctionDef, ast.AsyncFunctionDef))

    @cached_property
    def classes(self) -> list[tuple[int, int]]:
        """The first and last line of each class."""
        return list(_lines(self.module.tree, ast.ClassDef))

    @cached_property
    def values(self) -> dict[str, list[tuple[int, str]]]:
        """The calls whose values each name gets: their lines, and texts with the first argument."""
        found: dict[str, list[tuple[int, str]]] = defaultdict(list)
        for node in ast.walk(self.module.tree):
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
                first = node.value.args[:1]
                text = ast.unparse(node.value.func) + "".join(map(ast.unparse, first))
                for target in node.targets:
                    found[dotted(target)].append((node.lineno, text))
        return found

    @cached_property
    def annotated(self) -> list[tuple[ast.arg, int, int]]:
        """The arguments with annotations, each with the lines of its function."""
        return [
            (argument, node.lineno, node.end_lineno or node.lineno)
            for node in ast.walk(self.module.tree)
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
            if argument.annotation is not None
        ]

    @cached_property
    def stored_arguments(self) -> frozenset[str]:
        """The attributes that get the value of an annotated argument, as written."""
        names = {argument.arg for argument, _, _ in self.annotated}
        return frozenset(
            ast.unparse(node.targets[0])
            for node in ast.walk(self.module.tree)
            if isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Name)
            and node.value.id in names
        )

    @cached_property
    def called_with(self) -> dict[tuple[int, int, int], ast.expr]:
        """The functions that are called, by the place of each of their arguments."""
        found = {}
        for node in ast.walk(self.module.tree):
            if isinstance(node, ast.Call):
                for item in (*node.args, *(keyword.value for keyword in node.keywords)):
                    span = span_of(item, self.module.source)
                    found[span.line, span.column, span.length] = node.func
        return found

    @cached_property
    def unevaluated(self) -> list[ast.expr]:
        """The annotations that Python does not evaluate."""
        future = self.module.imports.get("annotations")
        postponed = future is not None and future.module == "__future__"
        return list(_unevaluated(self.module.tree, postponed=postponed))

    @cached_property
    def sets_names(self) -> bool:
        """Whether the file sets attributes by computed names."""
        return any(
            (isinstance(node, ast.Call) and dotted(node.func) == "setattr")
            or (isinstance(node, ast.Attribute) and node.attr == "__dict__")
            for node in ast.walk(self.module.tree)
        )


def _lines(tree: ast.Module, *kinds: type[ast.stmt]) -> Iterator[tuple[int, int]]:
    for node in ast.walk(tree):
        if isinstance(node, kinds):
            yield node.lineno, node.end_lineno or node.lineno


def _is_one_of_several(type_: str) -> bool:
    """Return whether a value may have several types, of which one may be right."""
    if type_.startswith("("):  # a function
        return False
    members = [item for item in type_.split(" | ") if item not in ("Any", "Unknown")]
    return len(members) > 1 and "None" not in members


def _differ(values: set[str]) -> bool:
    """Return whether values are of different classes, as far as their calls show."""
    classes = {value for value in values if value.rpartition(".")[2][:1].isupper()}
    created = {value for value in values if "create_" in value}
    return len(classes) > 1 or len(created) > 1


def _unevaluated(tree: ast.Module, *, postponed: bool) -> Iterator[ast.expr]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            for inner in ast.walk(node):
                if isinstance(inner, ast.AnnAssign):
                    yield inner.annotation
            if postponed:
                arguments = (item for item in ast.walk(node.args) if isinstance(item, ast.arg))
                yield from (item.annotation for item in arguments if item.annotation is not None)
                yield from [node.returns] if node.returns is not None else []
        elif isinstance(node, ast.AnnAssign) and postponed:
            yield node.annotation


def _defined_attributes(tree: ast.Module) -> Iterator[object]:
    """Yield the attributes that classes of a file define: methods, names, and what is set."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            for item in node.body:
                if isinstance(item, ast.FunctionDef | ast.AsyncFunctionDef):
                    yield item.name
                for inner in ast.walk(item) if isinstance(item, ast.Assign | ast.AnnAssign) else ():
                    if isinstance(inner, ast.Name):
                        yield inner.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr
        elif isinstance(node, ast.Call) and dotted(node.func) in ("hasattr", "setattr"):
            yield from (item.value for item in node.args if isinstance(item, ast.Constant))
