"""Calls that a method makes, read as syntax."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

from composer.behavior_source import BehaviorSource, Method
from composer.source import SourceFile, Span

_Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, slots=True)
class Call:
    """A call: the dotted name of what is called, imports followed, and whether it is awaited.

    ``deferred`` is true in a function within the method: it may run later, or in a thread.
    """

    name: str
    span: Span
    awaited: bool
    deferred: bool = False


def calls_of(source: BehaviorSource, method: Method) -> Iterator[Call]:
    """Yield what ``method`` calls, itself and through the methods of its class that it calls."""
    pending, seen = [method], {method.name}
    while pending:
        current = pending.pop()
        for call in _calls(current.span):
            yield call
            name = call.name.removeprefix("self.")
            is_own = call.name.startswith("self.") and not call.deferred
            following = source.method(name) if is_own else None
            if following is not None and name not in seen:
                seen.add(name)
                pending.append(following)


def _calls(span: Span) -> tuple[Call, ...]:
    return _calls_by_line(span.file.text, span.file.path).get(span.line, ())


@lru_cache(maxsize=64)
def _calls_by_line(text: str, path: str) -> Mapping[int, tuple[Call, ...]]:
    """Return the calls of every function in a file, by the line of its ``def``."""
    source = SourceFile(path, text)
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return {}
    imports = _imports(tree)
    return {
        node.lineno: tuple(_calls_in(node, imports, source))
        for node in ast.walk(tree)
        if isinstance(node, _Function)
    }


def _imports(tree: ast.Module) -> dict[str, str]:
    """Return what imported names stand for: ``sleep`` for ``time.sleep``."""
    names: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update({item.asname: item.name for item in node.names if item.asname})
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for item in node.names:
                names[item.asname or item.name] = f"{node.module}.{item.name}"
    return names


def _calls_in(
    function: _Function, imports: Mapping[str, str], source: SourceFile
) -> Iterator[Call]:
    """Yield the calls in a function, in the order of the text."""
    awaited: set[int] = set()
    pending: list[tuple[ast.AST, bool]] = [(node, False) for node in reversed(function.body)]
    while pending:
        node, deferred = pending.pop()
        if isinstance(node, ast.Await):
            awaited.add(id(node.value))
        if isinstance(node, ast.Call):
            name = _dotted(node.func, imports)
            if name:
                yield Call(name, _place(node.func, source), id(node) in awaited, deferred)
        within = deferred or isinstance(node, _Function | ast.Lambda | ast.ClassDef)
        pending.extend((child, within) for child in reversed(list(ast.iter_child_nodes(node))))


def _dotted(node: ast.expr, imports: Mapping[str, str]) -> str:
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return ""
    return ".".join((imports.get(node.id, node.id), *reversed(parts)))


def _place(node: ast.expr, source: SourceFile) -> Span:
    """Return the place of a name in characters; Python counts columns in UTF-8 bytes."""
    line = source.line(node.lineno).encode()
    start = len(line[: node.col_offset].decode(errors="replace"))
    same_line = node.end_lineno == node.lineno and node.end_col_offset is not None
    end = len(line[: node.end_col_offset].decode(errors="replace")) if same_line else start + 1
    return Span(source, node.lineno, start + 1, max(end - start, 1))
