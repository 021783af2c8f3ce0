"""Parse YAML 1.2 into a located tree, within limits that hold for any input.

Errors in a file become diagnostics with a location, never exceptions. A tree is returned whenever
possible, also together with diagnostics, so that later stages can report theirs.
"""

from __future__ import annotations

import codecs
import os
from collections.abc import Callable
from contextlib import closing
from functools import lru_cache
from itertools import islice
from pathlib import Path

import yaml

from composer.base.diagnostics import Diagnostic, nearest, shown
from composer.base.files import FileTooLargeError, NotRegularError, read_regular
from composer.base.source import SourceFile, Span, shown_path
from composer.language.document.builder import TreeBuilder, parse_events
from composer.language.document.parameter_files import ParameterFileBuilder
from composer.language.document.scalars import check_text, resolve_plain
from composer.language.rules import (
    KEY_WITHOUT_VALUE,
    MAX_BYTES,
    TOO_LARGE,
    UNREADABLE_FILE,
    YAML_SYNTAX,
    Stopped,
)
from composer.language.tree import Mapping, Scalar, ScalarValue, Tree, describe

#: Larger files are systems, which are parsed once anyway.
_MAX_CACHED_BYTES = 32_768
_FIRST_KEY_HINT = "begin with 'system: <name>' or 'node: <name>'"
_LONGEST_PATH = 4096  # PATH_MAX of Linux
_ENTRIES_FOR_HINT = 1000
_WIDE_ENCODINGS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


def read_document(
    path: Path, shown: str | None = None
) -> tuple[Mapping | None, SourceFile, list[Diagnostic]]:
    """Read the file at ``path``; ``shown`` is its name in diagnostics, by default its shown_path.

    Reads regular files only (through symbolic links), at most MAX_BYTES of them.
    """
    name = shown_path(path) if shown is None else shown
    unread = SourceFile(name)
    data, diagnostics = read_bytes(path, unread)
    return (None, unread, diagnostics) if diagnostics else parse_bytes(data, name)


def parse_bytes(data: bytes, shown: str) -> tuple[Mapping | None, SourceFile, list[Diagnostic]]:
    """Parse the content of a file or of standard input; ``shown`` is its name."""
    if len(data) > MAX_BYTES:
        source = SourceFile(shown)
        return None, source, [too_large(source)]
    parse = _parse_cached if len(data) <= _MAX_CACHED_BYTES else _parse
    tree, source, diagnostics = parse(data, shown)
    return tree, source, list(diagnostics)


def _parse(data: bytes, shown: str) -> tuple[Mapping | None, SourceFile, tuple[Diagnostic, ...]]:
    source, diagnostics = decode(data, shown)
    if diagnostics:
        return None, source, tuple(diagnostics)
    tree, diagnostics = parse_document(source)
    return tree, source, tuple(diagnostics)


#: A node type is parsed once, not for each system that uses it.
_parse_cached = lru_cache(maxsize=64)(_parse)


def parse_document(
    source: SourceFile,
    resolve: Callable[[str], ScalarValue] = resolve_plain,
    text: str | None = None,
) -> tuple[Mapping | None, list[Diagnostic]]:
    """Return the tree of a text and the diagnostics of its YAML.

    ``resolve`` returns the value of an unquoted scalar, or raises NumberRefused. ``text`` is what
    to parse in place of the source's own text; lines and columns are those of the source.
    """
    builder = TreeBuilder(source, resolve)
    diagnostics = _build(builder, source, text)
    if diagnostics is not None:
        return None, diagnostics
    return _root(builder.root, builder.diagnostics, source, _FIRST_KEY_HINT)


def read_parameter_document(path: Path, shown: str) -> tuple[Mapping | None, list[Diagnostic]]:
    """Read the ROS parameter file at ``path``, with the values that rcl reads from it.

    A key may occur more than once in a map, and comments may have invisible characters. A file
    without content is an empty map.
    """
    data, diagnostics = read_bytes(path, SourceFile(shown))
    if diagnostics:
        return None, diagnostics
    source, diagnostics = decode(data, shown)
    if diagnostics:
        return None, diagnostics
    builder = ParameterFileBuilder(source)
    stopped = _build(builder, source, may_be_invisible=True)
    if stopped is not None:
        return None, stopped
    tree = builder.merged()
    if tree is None:
        return Mapping((), Span(source, 1, 1)), builder.diagnostics
    return _root(tree, builder.diagnostics, source, "begin with the name of a node")


def _build(
    builder: TreeBuilder,
    source: SourceFile,
    text: str | None = None,
    *,
    may_be_invisible: bool = False,
) -> list[Diagnostic] | None:
    """Let ``builder`` handle the events of a text; return the diagnostics if it has no tree."""
    is_large = len(source.text) > MAX_BYTES
    diagnostics = [too_large(source)] if is_large else check_text(source, may_be_invisible)
    if diagnostics:
        return diagnostics
    try:
        with closing(parse_events(source.text if text is None else text)) as stream:
            builder.handle(stream)
    except Stopped as stopped:
        return [*builder.diagnostics, stopped.diagnostic]
    except (yaml.YAMLError, ValueError) as error:
        from composer.language.document.syntax_errors import explain  # noqa: PLC0415 - only for invalid files

        return _with_syntax(builder.diagnostics, explain(error, source, builder.open_bracket))
    return None


def _with_syntax(diagnostics: list[Diagnostic], syntax: Diagnostic) -> list[Diagnostic]:
    """Add the parser's diagnostic, unless it only follows from text in braces before it."""
    confused = any(
        diagnostic.rule is KEY_WITHOUT_VALUE and diagnostic.primary.line == syntax.primary.line
        for diagnostic in diagnostics
    )
    return diagnostics if confused else [*diagnostics, syntax]


def _root(
    tree: Tree | None, diagnostics: list[Diagnostic], source: SourceFile, first_key_hint: str
) -> tuple[Mapping | None, list[Diagnostic]]:
    if isinstance(tree, Mapping):
        return tree, diagnostics
    if tree is None or (isinstance(tree, Scalar) and tree.value is None):
        message, span, hint = "this file is empty", Span(source, 1, 1), first_key_hint
    else:
        message, span, hint = f"expected keys and values, found {describe(tree)}", tree.span, None
        if isinstance(tree, Scalar) and ":" in str(tree.value):
            hint = "put a space after the colon"
    return None, [*diagnostics, Diagnostic(YAML_SYNTAX, message, span, hint=hint or first_key_hint)]


def read_bytes(path: Path, source: SourceFile) -> tuple[bytes, list[Diagnostic]]:
    """Return the content of a regular file of at most MAX_BYTES, or a diagnostic."""

    def unread(message: str, hint: str | None = None) -> tuple[bytes, list[Diagnostic]]:
        return b"", [Diagnostic(UNREADABLE_FILE, message, Span(source, 1, 1), hint=hint)]

    try:
        return read_regular(path, MAX_BYTES), []
    except FileTooLargeError:
        return b"", [too_large(source)]
    except FileNotFoundError:
        return unread("there is no such file", similar_file(path, str(path), ""))
    except NotRegularError as error:
        return unread(error.strerror or str(error))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        return unread(f"this file cannot be read: {reason or error}")


def too_large(source: SourceFile) -> Diagnostic:
    """Return the diagnostic for a text of more than MAX_BYTES."""
    return Diagnostic(
        TOO_LARGE,
        f"this file is larger than {MAX_BYTES:,} bytes",
        Span(source, 1, 1),
        hint="split the system, or declare repeated nodes once as a node type",
    )


def decode(data: bytes, shown_path: str) -> tuple[SourceFile, list[Diagnostic]]:
    """Return the text of UTF-8 ``data`` (a byte-order mark is dropped), or a diagnostic."""
    content = data.removeprefix(codecs.BOM_UTF8)
    try:
        return SourceFile(shown_path, content.decode("utf-8")), []
    except UnicodeDecodeError as error:
        source = SourceFile(shown_path, content.decode("utf-8", errors="replace"))
        before = SourceFile("", content[: error.start].decode("utf-8")).lines
        span = Span(source, len(before), len(before[-1]) + 1)
        return source, [_not_utf8(content, error.start, span)]


def _not_utf8(data: bytes, offset: int, span: Span) -> Diagnostic:
    encoding = _WIDE_ENCODINGS.get(data[:2])
    if encoding is not None:
        message = f"this file is {encoding}, not UTF-8"
    else:
        message = f"the byte 0x{data[offset]:02x} is not UTF-8"
    return Diagnostic(UNREADABLE_FILE, message, span, hint="save the file as UTF-8")


def similar_file(path: Path, name: str, *suffixes: str) -> str | None:
    """Return a hint with the file next to ``path`` that its ``name`` was probably meant to be."""
    close = nearest(path.name, [other for other in _names(path.parent) if other.endswith(suffixes)])
    if close is None:
        return None
    # Do not shorten the path: its end is the part that differs.
    return f"did you mean '{shown(Path(name).with_name(close), limit=_LONGEST_PATH)}'?"


def _names(folder: Path) -> list[str]:
    """Return the first names in a folder."""
    try:
        with os.scandir(folder) as entries:
            return [entry.name for entry in islice(entries, _ENTRIES_FOR_HINT)]
    except (OSError, ValueError):
        return []
