"""Parse YAML 1.2 into a located tree, within limits that hold for any input.

Errors in a file become diagnostics with a location, never exceptions. A tree is returned whenever
possible, also together with diagnostics, so that later stages can report theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from functools import lru_cache
from pathlib import Path

import yaml

from composer.base.diagnostics import Diagnostic
from composer.base.source import SourceFile, Span, shown_path
from composer.language.document.builder import Stopped, TreeBuilder
from composer.language.document.error_limit import TooManyErrors
from composer.language.document.events import parse_events
from composer.language.document.files import decode, read_bytes, too_large
from composer.language.document.limits import MAX_BYTES
from composer.language.document.parameter_files import ParameterFileBuilder
from composer.language.document.rules import KEY_WITHOUT_VALUE, YAML_SYNTAX
from composer.language.document.scalars import check_text, resolve_plain
from composer.language.tree import Mapping, Scalar, ScalarValue, Tree, describe

#: Larger files are systems, which are parsed once anyway.
_MAX_CACHED_BYTES = 32_768
_FIRST_KEY_HINT = "begin with 'system: <name>' or 'node: <name>'"

__all__ = ["parse_bytes", "parse_document", "read_document", "read_parameter_document"]


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
    source: SourceFile, resolve: Callable[[str], ScalarValue] = resolve_plain
) -> tuple[Mapping | None, list[Diagnostic]]:
    """Return the tree of a text and the diagnostics of its YAML.

    ``resolve`` returns the value of an unquoted scalar, or raises NumberRefused.
    """
    builder = TreeBuilder(source, resolve)
    diagnostics = _build(builder, source)
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
    builder: TreeBuilder, source: SourceFile, *, may_be_invisible: bool = False
) -> list[Diagnostic] | None:
    """Let ``builder`` handle the events of a text; return the diagnostics if it has no tree."""
    is_large = len(source.text) > MAX_BYTES
    diagnostics = [too_large(source)] if is_large else check_text(source, may_be_invisible)
    if diagnostics:
        return diagnostics
    try:
        with closing(parse_events(source.text)) as stream:
            for event in stream:
                builder.handle(event)
    except (Stopped, TooManyErrors) as stopped:
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
