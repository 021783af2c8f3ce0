"""The syntax of one Python file: its classes with their bases and methods, and its imports."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace
from functools import cached_property, lru_cache
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.python_code.modules import Unreadable, read_text
from composer.python_code.scopes import Call, Scope
from composer.python_code.trees import (
    SCOPES,
    Function,
    Import,
    children,
    dotted,
    full_names,
    imports_in,
    name_span,
    positional_arguments,
    span_of,
    walk,
)

#: Maximum depth of an expression: with more, functions of ``ast`` exceed Python's stack.
MAXIMUM_DEPTH = 250
#: Decorators that do not hide the signature of a method.
_TRANSPARENT = frozenset({"staticmethod", "classmethod", "override", "typing.override"})


@dataclass(frozen=True)
class Method:
    """A method of a class.

    ``scope`` is None for an attribute of the class, whose value may be a function.
    """

    name: str
    span: Span = field(compare=False)
    scope: Scope | None = field(default=None, repr=False)

    @property
    def node(self) -> Function | None:
        """The definition of the method."""
        return self.scope.function if self.scope is not None else None

    @property
    def calls(self) -> tuple[Call, ...]:
        """The calls in the method, in source order."""
        return self.scope.calls if self.scope is not None else ()

    @property
    def mentioned(self) -> tuple[str, ...]:
        """The names that the method uses without calling them."""
        return self.scope.mentioned if self.scope is not None else ()

    @property
    def is_async(self) -> bool:
        """Whether the method is a coroutine."""
        return isinstance(self.node, ast.AsyncFunctionDef)

    @property
    def known(self) -> bool:
        """Whether the signature is known: no decorator and no assignment hides it."""
        if self.node is None or not {*map(_plain_name, self.node.decorator_list)} <= _TRANSPARENT:
            return False
        return self._is_static or bool(positional_arguments(self.node))

    @property
    def _is_static(self) -> bool:
        decorators = self.node.decorator_list if self.node is not None else ()
        return any(_plain_name(decorator) == "staticmethod" for decorator in decorators)

    @property
    def arguments(self) -> tuple[str, ...]:
        """The positional arguments without ``self``."""
        if self.node is None:
            return ()
        names = [item.arg for item in positional_arguments(self.node)]
        return tuple(names if self._is_static else names[1:])

    @property
    def required(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The arguments without a default: positional ones, and those passed by keyword."""
        if self.node is None:
            return (), ()
        given = self.node.args
        pairs = zip(given.kwonlyargs, given.kw_defaults, strict=True)
        keywords = tuple(item.arg for item, default in pairs if default is None)
        return self.arguments[: max(len(self.arguments) - len(given.defaults), 0)], keywords

    def accepts(self, count: int) -> bool:
        """Return whether it can be called with ``count`` positional arguments."""
        if not self.known or self.node is None:
            return True
        needed, keywords = self.required
        maximum = count if self.node.args.vararg is not None else len(self.arguments)
        return not keywords and len(needed) <= count <= maximum


@dataclass(frozen=True, slots=True, eq=False)
class Class:
    """A class. ``dynamic`` is true if it may have members that its syntax does not show."""

    name: str
    span: Span
    bases: tuple[str, ...]  # dotted, as written; "" for other expressions
    methods: tuple[Method, ...]
    dynamic: bool
    node: ast.ClassDef = field(repr=False, compare=False)


@dataclass(frozen=True, eq=False)
class Module:
    """The top-level definitions and imports of a Python file.

    ``imports`` has the names with one origin, ``alternatives`` those that several imports bind.
    """

    path: Path
    source: SourceFile
    tree: ast.Module = field(repr=False)
    classes: dict[str, Class]
    imports: dict[str, Import]
    alternatives: dict[str, tuple[Import, ...]]
    dynamic: bool  # it may have names that its syntax does not show

    @cached_property
    def names(self) -> Mapping[str, str]:
        """The full names of what absolute imports bind."""
        return full_names(self.imports.items())


def read_module(path: Path, shown: str) -> Module:
    """Read a Python file; ``shown`` is its path in messages. Raises Unreadable."""
    try:
        status = path.stat()
    except OSError as error:
        raise Unreadable(f"cannot be read: {error.strerror}") from None
    return _read_module(path, shown, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=128)
def _read_module(path: Path, shown: str, _changed_ns: int, _bytes: int) -> Module:
    source = SourceFile(shown, read_text(path))
    tree = parse(source)
    statements = [*walk(tree.body, closed=SCOPES)]
    origins: dict[str, dict[Import, None]] = {}
    for name, origin in imports_in(statements):
        origins.setdefault(name, {})[origin] = None
    imports = {name: found for name, (found, *others) in origins.items() if not others}
    names = full_names(imports.items())
    functions = {item.name for item in statements if isinstance(item, Function)}
    everywhere = Scope(source, tree, names)
    classes = [_class(item, everywhere) for item in statements if isinstance(item, ast.ClassDef)]
    return Module(
        path=path,
        source=source,
        tree=tree,
        classes={item.name: item for item in classes},
        imports=imports,
        alternatives={name: (*found,) for name, found in origins.items() if name not in imports},
        dynamic="*" in origins or "__getattr__" in functions,
    )


def parse(source: SourceFile) -> ast.Module:
    """Return the syntax tree of a file. Raises Unreadable if it is not Python.

    What only Python's compiler finds, such as 'return' outside a function, is left to the checker.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(source.text)
    except SyntaxError as error:
        line = min(max(error.lineno or 1, 1), max(len(source.lines), 1))
        column = min(max(error.offset or 1, 1), len(source.line(line)) + 1)
        end = error.end_offset if error.end_lineno == error.lineno else None
        length = min((end or 0) - column, len(source.line(line)) - column + 2)
        span = Span(source, line, column, max(length, 1))
        raise Unreadable(f"is not Python: {error.msg}", span) from None
    except (ValueError, RecursionError, MemoryError):
        raise Unreadable("is not Python: it cannot be parsed") from None
    pending: list[tuple[ast.AST, int]] = [(tree, 0)]
    while pending:
        node, depth = pending.pop()
        if depth > MAXIMUM_DEPTH:
            raise Unreadable("has expressions that are nested too deep to be checked")
        depth = 0 if isinstance(node, ast.stmt) else depth + 1
        pending += [(child, depth) for child in children(node)]
    return tree


def scopes_in(classes: Iterable[tuple[Module, Class]]) -> Iterator[Scope]:
    """Yield the methods of classes."""
    methods = (method for _, class_ in classes for method in class_.methods)
    yield from (method.scope for method in methods if method.scope is not None)


@lru_cache(maxsize=128)
def defined_names(module: Module) -> frozenset[str]:
    """Return the names that a file defines or imports, at its top level or below."""
    names = {name.partition(".")[0] for name in (*module.imports, *module.alternatives)}
    for node in walk(module.tree.body):
        if isinstance(node, Function | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
    return frozenset(names)


def _class(node: ast.ClassDef, module: Scope) -> Class:
    methods, source = {}, module.source
    for item in walk(node.body, closed=SCOPES):
        if isinstance(item, Function):
            span = name_span(item, "def", source)
            scope = replace(module, function=item, class_=node)
            methods[item.name] = Method(item.name, span, scope)
        elif isinstance(item, ast.Name) and isinstance(item.ctx, ast.Store):
            methods[item.id] = Method(item.id, span_of(item, source))
    return Class(
        name=node.name,
        span=name_span(node, "class", source),
        bases=tuple(map(_plain_name, node.bases)),
        methods=tuple(methods.values()),
        dynamic=bool(node.decorator_list or node.keywords) or "__getattr__" in methods,
        node=node,
    )


def _plain_name(node: ast.expr) -> str:
    """Return a dotted name as written, without the subscript of ``Base[T]``; "" for other nodes."""
    return dotted(node.value if isinstance(node, ast.Subscript) else node)
