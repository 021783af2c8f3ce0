"""Write a located tree as readable YAML 1.2 that parses to the same tree, in the canonical form."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from collections.abc import Mapping as Map
from types import MappingProxyType
from typing import TypeAlias, TypeVar

from composer.language.document.scalars import resolve_plain
from composer.language.schema import NODE, SYSTEM, schema
from composer.language.tree import Entry, Mapping, Scalar, ScalarValue, Sequence, Tree

_WIDTH = 100
_INDENT = "  "
#: Texts that need no quotes in any context, unless YAML reads them as another type.
_PLAIN = re.compile(r"[A-Za-z_/](?:[A-Za-z0-9_./ -]*[A-Za-z0-9_./])?")
_SECTION = 1  # the depth of the values of a file's keys


#: Comments by the keys of the entries that they are written above, from the outermost map on.
Comments: TypeAlias = "Map[tuple[str, ...], Iterable[str]]"
T = TypeVar("T")
_ARGUMENTS = "arguments"
_NODES = "nodes"


def write_document(tree: Mapping, comments: Comments | None = None) -> str:
    """Return ``tree`` as YAML.

    Sections are in block style; within them, a value that fits into a line is in flow style, unless
    something in it has a comment. The comments of the empty path are written above everything.
    """
    given = comments or {}
    head = _comment_lines(given.get((), ()))
    return "".join(f"{line}\n" for line in (*head, *_block(tree, 0, (), given)))


def _block(
    tree: Tree, depth: int, path: tuple[str, ...] = (), comments: Comments = MappingProxyType({})
) -> Iterator[str]:
    """Yield the lines of a map or list that is not empty."""
    match tree:
        case Mapping():
            for entry in tree:
                inner = (*path, entry.name)
                yield from _comment_lines(comments.get(inner, ()))
                yield from _entry(f"{_scalar(entry.name)}:", entry.value, depth, inner, comments)
        case Sequence():
            for item in tree.items:
                yield from _item(item, depth)
        case Scalar():
            yield _scalar(tree.value)


def _comment_lines(texts: Iterable[str]) -> Iterator[str]:
    """Yield comments as lines; a character that would end or hide a comment is escaped."""
    for text in texts:
        safe = "".join(item if item.isprintable() else ascii(item)[1:-1] for item in text)
        yield f"# {safe}".rstrip()


def _entry(
    key: str, value: Tree, depth: int, path: tuple[str, ...], comments: Comments
) -> Iterator[str]:
    line = f"{key} {_flow(value)}"
    has_comments = any(len(at) > len(path) and at[: len(path)] == path for at in comments)
    if not has_comments and _is_flow(value, line, depth + 1):
        yield line
        return
    yield key
    for inner in _block(value, depth + 1, path, comments):
        yield f"{_INDENT}{inner}"


def _item(value: Tree, depth: int) -> Iterator[str]:
    line = f"- {_flow(value)}"
    if _is_flow(value, line, depth + 1):
        yield line
        return
    for number, inner in enumerate(_block(value, depth + 1)):
        yield f"{_INDENT if number else '- '}{inner}"


def _is_flow(tree: Tree, line: str, depth: int) -> bool:
    inner = _inner(tree)
    if not inner:
        return True
    if depth == _SECTION and any(_inner(part) for part in inner):
        return False
    return len(line) + len(_INDENT) * (depth - 1) <= _WIDTH


def _inner(tree: Tree) -> tuple[Tree, ...]:
    match tree:
        case Mapping():
            return tuple(entry.value for entry in tree)
        case Sequence():
            return tree.items
        case Scalar():
            return ()


def _flow(tree: Tree) -> str:
    match tree:
        case Mapping():
            entries = (f"{_scalar(entry.name)}: {_flow(entry.value)}" for entry in tree)
            return f"{{{', '.join(entries)}}}"
        case Sequence():
            return f"[{', '.join(map(_flow, tree.items))}]"
        case Scalar():
            return _scalar(tree.value)


def _scalar(value: ScalarValue) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str():
            return value if _is_plain(value) else _quoted(value)
        case _:
            return repr(value)


def _is_plain(text: str) -> bool:
    return _PLAIN.fullmatch(text) is not None and resolve_plain(text) == text


def _quoted(text: str) -> str:
    """Return a text in double quotes, with escapes for everything that is not printable."""
    return "".join(
        character if character.isprintable() else f"\\U{ord(character):08x}"
        for character in json.dumps(text, ensure_ascii=False)
    )


def canonical(tree: Mapping) -> Mapping:
    """Return an assembled tree as one equivalent file, with its keys in the usual order.

    The arguments of a system have been expanded, so the section is left out. Any text that still
    looks like a variable is escaped.
    """
    if tree.entry(SYSTEM) is None:
        return _sort_keys(tree, schema(NODE)["properties"])
    system = schema(SYSTEM)
    definitions = system["definitions"]
    node_keys = {
        **definitions["node_with_type"]["properties"],
        **definitions["inline_node"]["properties"],
    }
    entries = [
        Entry(
            entry.key,
            _nodes(entry.value, node_keys) if entry.name == _NODES else _escape(entry.value),
        )
        for entry in tree
        if entry.name != _ARGUMENTS
    ]
    return _sort_keys(Mapping(tuple(entries), tree.span), system["properties"])


def _nodes(tree: Tree, keys: Iterable[str]) -> Tree:
    if not isinstance(tree, Mapping):
        return tree
    entries = (
        Entry(_escape_text(entry.key), _sort_keys(_escape(entry.value), keys)) for entry in tree
    )
    return Mapping(tuple(entries), tree.span)


def _sort_keys(tree: T, keys: Iterable[str]) -> T | Mapping:
    """Return a map with its keys in the order of ``keys``, and any other value unchanged."""
    if not isinstance(tree, Mapping):
        return tree
    positions = {name: position for position, name in enumerate(keys)}
    entries = sorted(tree, key=lambda entry: positions.get(entry.name, len(positions)))
    return Mapping(tuple(entries), tree.span)


def _escape(tree: Tree) -> Tree:
    match tree:
        case Mapping():
            entries = tuple(Entry(entry.key, _escape(entry.value)) for entry in tree)
            return Mapping(entries, tree.span)
        case Sequence():
            return Sequence(tuple(map(_escape, tree.items)), tree.span)
        case Scalar():
            return _escape_text(tree)


def _escape_text(scalar: Scalar) -> Scalar:
    if not isinstance(scalar.value, str) or "${" not in scalar.value:
        return scalar
    return Scalar(scalar.value.replace("${", "$${"), scalar.span, verbatim=False)
