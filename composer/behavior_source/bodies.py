"""What a method calls and which publishers it names, from one walk over its text."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from composer.behavior_source.places import place_of
from composer.source import SourceFile, Span

Function = ast.FunctionDef | ast.AsyncFunctionDef

_PUBLISHERS = "self.publishers"
#: What is in one of them may run later, or in a thread.
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
#: A name may stand for one that stands for another, and so on.
_LONGEST_ALIAS = 4


@dataclass(frozen=True, slots=True)
class Call:
    """A call: the dotted name of what is called, and whether it is awaited.

    Imports are followed in the name, and local names of publishers. ``deferred`` is true in a
    function within the method: it may run later, or in a thread.
    """

    name: str
    span: Span
    awaited: bool
    deferred: bool = False


@dataclass(slots=True)
class Body:
    """What a method does, as far as its text tells.

    ``calls`` are in the order of the text; ``mentioned`` are names that it uses otherwise: hands
    on, keeps, asks. ``names`` are what its own short names stand for.
    """

    calls: tuple[Call, ...]
    mentioned: tuple[str, ...]
    names: Mapping[str, str]

    def full_name(self, node: ast.expr) -> str:
        """Return the dotted name of an expression, names followed; "" for what is none."""
        return _followed(dotted(node), self.names)


def read_body(function: Function, imports: Mapping[str, str], source: SourceFile) -> Body:
    """Read a method; ``imports`` says what names of its file stand for."""
    seen = _Seen(dict(imports))
    seen.assigned.update(
        inner.arg for inner in ast.walk(function.args) if isinstance(inner, ast.arg)
    )
    pending: list[tuple[ast.AST, bool]] = [(node, False) for node in reversed(function.body)]
    while pending:
        node, deferred = pending.pop()
        children = seen.take(node, deferred)
        within = deferred or isinstance(node, _SCOPES)
        pending.extend((child, within) for child in reversed(children))
    names = seen.names()
    return Body(
        calls=tuple(
            Call(
                _followed(name, names), place_of(node.func, source), id(node) in seen.awaited, late
            )
            for name, node, late in seen.calls
        ),
        mentioned=tuple(_followed(name, names) for name in seen.mentioned_but(names)),
        names=names,
    )


def dotted(node: ast.expr) -> str:
    """Return a dotted name as written; "" for what is not one."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return ""
    return ".".join((node.id, *reversed(parts)))


@dataclass(slots=True)
class _Seen:
    """What the walk has come across; names are as written."""

    imports: dict[str, str]
    calls: list[tuple[str, ast.Call, bool]] = field(default_factory=list)
    awaited: set[int] = field(default_factory=set)
    mentioned: list[str] = field(default_factory=list)
    aliases: list[tuple[str, str]] = field(default_factory=list)
    assigned: Counter[str] = field(default_factory=Counter)

    def take(self, node: ast.AST, deferred: bool) -> list[ast.AST]:
        """Note what ``node`` is, and return what is in it that is still to be looked at."""
        children: list[ast.AST] = []
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                self.mentioned.append(name)
            case ast.Name(id=name) | ast.arg(arg=name):
                self.assigned[name] += 1
            case ast.Attribute():
                children = self._attribute(node)
            case ast.Call():
                children = self._call(node, deferred)
            case ast.Assign(targets=[ast.Name(id=name)], value=value) if dotted(value):
                self.assigned[name] += 1
                self.aliases.append((name, dotted(value)))
            case ast.Import() | ast.ImportFrom():
                self.imports.update(imported_names(node))
            case ast.Await(value=value):
                self.awaited.add(id(value))
                children = [value]
            case _:
                children = list(ast.iter_child_nodes(node))
        return children

    def names(self) -> Mapping[str, str]:
        """Return what names stand for: imports, and local names of publishers.

        A name that is given twice may stand for either, and is left as it is.
        """
        local = {name: value for name, value in self.aliases if self.assigned[name] == 1}
        followed = {name: _followed(value, local) for name, value in local.items()}
        publishers = {
            name: value
            for name, value in followed.items()
            if f"{value}.".startswith(f"{_PUBLISHERS}.")
        }
        return self.imports | publishers

    def mentioned_but(self, names: Mapping[str, str]) -> Iterator[str]:
        """Yield what is mentioned otherwise than to give it one of ``names``."""
        yield from self.mentioned
        yield from (value for name, value in self.aliases if name not in names)

    def _attribute(self, node: ast.Attribute) -> list[ast.AST]:
        name = dotted(node)
        if not name:
            return [node.value]
        self.mentioned.append(name)
        return []

    def _call(self, node: ast.Call, deferred: bool) -> list[ast.AST]:
        given: list[ast.AST] = [*node.args, *(keyword.value for keyword in node.keywords)]
        name = dotted(node.func)
        if not name:
            return [node.func, *given]
        self.calls.append((name, node, deferred))
        return given


def imported_names(node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, str]]:
    """Yield what imported names stand for: ``sleep`` for ``time.sleep``."""
    if isinstance(node, ast.Import):
        yield from ((item.asname, item.name) for item in node.names if item.asname)
    elif node.module and not node.level:
        for item in node.names:
            yield item.asname or item.name, f"{node.module}.{item.name}"


def _followed(name: str, names: Mapping[str, str]) -> str:
    for _ in range(_LONGEST_ALIAS):
        head, dot, rest = name.partition(".")
        if head not in names:
            break
        name = f"{names[head]}{dot}{rest}"
    return name
