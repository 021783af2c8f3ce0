"""The syntax of one Python file: its classes with their bases and methods, and its imports."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from functools import lru_cache
from pathlib import Path

from composer.fast_dataclass import dataclass
from composer.python_code.source.compilation import NotPython, parse
from composer.python_code.source.method_body import (
    Call,
    Function,
    dotted,
    imported_names,
    read_body,
)
from composer.python_code.source.modules import Unreadable, read_text
from composer.python_code.source.publishing import PublisherUses, publisher_uses
from composer.python_code.source.spans import start_span
from composer.python_code.source.traversal import walk
from composer.source import SourceFile, Span


@dataclass(frozen=True, slots=True)
class Method:
    """A method of a behavior.

    ``arguments`` are the positional arguments without ``self``; the last ``optional`` of them have
    defaults. ``known`` is false if a decorator or an assignment hides the signature.
    """

    name: str
    span: Span = field(compare=False)
    arguments: tuple[str, ...] = ()
    optional: int = 0
    variadic: bool = False  # accepts *arguments
    keywords: tuple[str, ...] = ()  # keyword-only arguments without a default
    is_async: bool = False
    known: bool = True
    node: Function | None = field(default=None, repr=False, compare=False)
    calls: tuple[Call, ...] = field(default=(), compare=False)
    publishing: PublisherUses = field(default_factory=PublisherUses)

    def accepts(self, count: int) -> bool:
        """Return whether it can be called with ``count`` positional arguments."""
        if not self.known:
            return True
        maximum = count if self.variadic else len(self.arguments)
        return not self.keywords and len(self.arguments) - self.optional <= count <= maximum


@dataclass(frozen=True, slots=True, eq=False)
class Class:
    """A class. ``dynamic`` is true if it may have members that its syntax does not show."""

    name: str
    span: Span
    bases: tuple[str, ...]  # dotted, as written; "" for other expressions
    methods: tuple[Method, ...]
    dynamic: bool
    node: ast.ClassDef = field(repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class Import:
    """``from module import name``, or ``import module`` with an empty name."""

    module: str
    name: str
    level: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Module:
    """The top-level definitions and imports of a Python file."""

    path: Path
    source: SourceFile
    tree: ast.Module = field(repr=False)
    classes: dict[str, Class]
    imports: dict[str, Import]
    assigned: frozenset[str]
    dynamic: bool  # it may have names that its syntax does not show

    def may_have(self, name: str) -> bool:
        """Return whether ``name`` may exist without a class statement in this file."""
        return self.dynamic or name in self.imports or name in self.assigned


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
    try:
        tree = parse(source)
    except NotPython as error:
        raise Unreadable(f"is not Python: {error}", error.span) from None
    statements = tuple(_top_level(tree.body))
    names = dict(_imported_names(statements))
    classes = (item for item in statements if isinstance(item, ast.ClassDef))
    imports = dict(_imports(statements))
    return Module(
        path=path,
        source=source,
        tree=tree,
        classes={item.name: _class(item, names, source) for item in classes},
        imports=imports,
        assigned=frozenset(name.id for item in statements for name in _assigned(item)),
        dynamic="*" in imports or any(_is_getattr(item) for item in statements),
    )


@lru_cache(maxsize=128)
def defined_names(module: Module) -> frozenset[str]:
    """Return the names that a file defines or imports, at its top level or below."""
    names = {name.partition(".")[0] for name in module.imports}
    for item in walk(module.tree.body):
        match item:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                names.add(name)
            case ast.ClassDef(name=name) | ast.Name(id=name, ctx=ast.Store()):
                names.add(name)
    return frozenset(names)


def _top_level(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements of a body, including those in an if, a try or a with."""
    pending = list(body)[::-1]
    while pending:
        statement = pending.pop()
        yield statement
        inner: list[ast.stmt] = []
        for name in ("body", "orelse", "finalbody"):
            if isinstance(statement, ast.If | ast.Try | ast.With):
                inner.extend(getattr(statement, name, ()))
        if isinstance(statement, ast.Try):
            inner.extend(item for handler in statement.handlers for item in handler.body)
        pending.extend(reversed(inner))


def _imports(statements: Iterable[ast.stmt]) -> Iterator[tuple[str, Import]]:
    for statement in statements:
        if isinstance(statement, ast.ImportFrom):
            for alias in statement.names:
                found = Import(statement.module or "", alias.name, statement.level)
                yield alias.asname or alias.name, found
        elif isinstance(statement, ast.Import):
            for alias in statement.names:
                bound = alias.asname or alias.name
                yield bound, Import(alias.name, "")


def _imported_names(statements: Iterable[ast.stmt]) -> Iterator[tuple[str, str]]:
    for statement in statements:
        if isinstance(statement, ast.Import | ast.ImportFrom):
            yield from imported_names(statement)


def _class(node: ast.ClassDef, names: Mapping[str, str], source: SourceFile) -> Class:
    statements = tuple(_top_level(node.body))
    methods = {
        method.name: method for item in statements for method in _methods(item, names, source)
    }
    dynamic = bool(node.decorator_list or node.keywords) or "__getattr__" in methods
    return Class(
        node.name,
        name_span(node, "class", source),
        tuple(_dotted(base) for base in node.bases),
        tuple(methods.values()),
        dynamic,
        node,
    )


def _methods(statement: ast.stmt, names: Mapping[str, str], source: SourceFile) -> Iterator[Method]:
    if isinstance(statement, Function):
        yield _method(statement, names, source)
        return
    for target in _assigned(statement):
        yield Method(target.id, start_span(target, len(target.id), source), known=False)


def _assigned(statement: ast.stmt) -> Iterator[ast.Name]:
    """Yield the names that a statement assigns."""
    targets: list[ast.expr] = []
    if isinstance(statement, ast.Assign):
        targets = statement.targets
    elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
        targets = [statement.target]
    yield from (target for target in targets if isinstance(target, ast.Name))


def _is_getattr(statement: ast.stmt) -> bool:
    return isinstance(statement, Function) and statement.name == "__getattr__"


def _method(node: Function, names: Mapping[str, str], source: SourceFile) -> Method:
    body = read_body(node, names, source)
    decorators = {_dotted(decorator) for decorator in node.decorator_list}
    positional = [item.arg for item in (*node.args.posonlyargs, *node.args.args)]
    static = "staticmethod" in decorators
    return Method(
        name=node.name,
        span=name_span(node, "def", source),
        arguments=tuple(positional if static else positional[1:]),
        optional=min(len(node.args.defaults), len(positional)),
        variadic=node.args.vararg is not None,
        keywords=tuple(
            argument.arg
            for argument, default in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)
            if default is None
        ),
        is_async=isinstance(node, ast.AsyncFunctionDef),
        known=decorators <= _TRANSPARENT and bool(positional or static),
        node=node,
        calls=body.calls,
        publishing=publisher_uses(node, body),
    )


_TRANSPARENT = frozenset({"staticmethod", "classmethod", "override", "typing.override"})


def _dotted(node: ast.expr) -> str:
    """Return a dotted name as written, without the subscript of ``Base[T]``; "" for other nodes."""
    return dotted(node.value if isinstance(node, ast.Subscript) else node)


def name_span(node: Function | ast.ClassDef, keyword: str, source: SourceFile) -> Span:
    """Return the span of the name after ``def`` or ``class``."""
    span = start_span(node, len(node.name), source)
    found = re.search(rf"{keyword}\s+({re.escape(node.name)})\b", source.line(span.line))
    return Span(source, span.line, found.start(1) + 1, span.length) if found else span
