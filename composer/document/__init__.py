"""Text to located tree: YAML 1.2, read under limits that hold for any bytes whatever.

Nothing here raises for what is in a file: it becomes a finding with its place. A tree comes
back whenever there is one, also beside findings, so that later stages can say what they find.
"""

from __future__ import annotations

from contextlib import closing
from functools import lru_cache
from pathlib import Path

import yaml

from composer.diagnostics import Diagnostic
from composer.document.builder import Stopped, TreeBuilder, too_many_values
from composer.document.characters import check_text
from composer.document.events import excess, parse_events
from composer.document.files import decode, read_bytes, too_large
from composer.document.limits import MAX_BYTES
from composer.document.rules import KEY_WITHOUT_VALUE, NOT_A_MAP
from composer.document.words import described
from composer.source import SourceFile, Span
from composer.tree import Mapping, Scalar, Tree

#: What is larger is a system that nobody else reads.
_KEPT_BYTES = 32_768
_WHAT_A_FILE_IS = "begin with 'system: <name>' or 'node: <name>'"

__all__ = ["parse_bytes", "parse_document", "read_document"]


def read_document(
    path: Path, shown: str | None = None
) -> tuple[Mapping | None, SourceFile, list[Diagnostic]]:
    """Read the file at ``path``; ``shown`` is its name in findings, ``path`` itself by default.

    Reads regular files only (through symbolic links), at most MAX_BYTES of them.
    """
    name = str(path) if shown is None else shown
    unread = SourceFile(name)
    data, findings = read_bytes(path, unread)
    return (None, unread, findings) if findings else parse_bytes(data, name)


def parse_bytes(data: bytes, shown: str) -> tuple[Mapping | None, SourceFile, list[Diagnostic]]:
    """Read what came from somewhere else, such as standard input; ``shown`` is its name."""
    if len(data) > MAX_BYTES:
        source = SourceFile(shown)
        return None, source, [too_large(source)]
    parse = _parsed_before if len(data) <= _KEPT_BYTES else _parsed
    tree, source, findings = parse(data, shown)
    return tree, source, list(findings)


def _parsed(data: bytes, shown: str) -> tuple[Mapping | None, SourceFile, tuple[Diagnostic, ...]]:
    source, findings = decode(data, shown)
    if findings:
        return None, source, tuple(findings)
    tree, findings = parse_document(source)
    return tree, source, tuple(findings)


#: A node type is parsed once, and not for each system that uses it.
_parsed_before = lru_cache(maxsize=64)(_parsed)


def parse_document(source: SourceFile) -> tuple[Mapping | None, list[Diagnostic]]:
    """Return the tree of a text, and what is wrong with it as YAML."""
    if len(source.text) > MAX_BYTES:
        return None, [too_large(source)]
    findings = check_text(source)
    if findings:
        return None, findings
    builder = TreeBuilder(source)
    try:
        surplus = excess(source.text)
        if surplus is not None:
            return None, [too_many_values(source, surplus)]
        with closing(parse_events(source.text)) as stream:
            for event in stream:
                builder.take(event)
    except Stopped as stopped:
        return None, [*builder.findings, stopped.finding]
    except (yaml.YAMLError, ValueError) as error:
        from composer.document.syntax import explain  # noqa: PLC0415 - for files that are wrong

        return None, _with_syntax(builder.findings, explain(error, source, builder.open_bracket))
    return _root(builder.root, builder.findings, source)


def _with_syntax(findings: list[Diagnostic], syntax: Diagnostic) -> list[Diagnostic]:
    """Add the parser's finding, unless text in braces before it is what confused the parser."""
    confused = any(
        finding.rule is KEY_WITHOUT_VALUE and finding.primary.line == syntax.primary.line
        for finding in findings
    )
    return findings if confused else [*findings, syntax]


def _root(
    tree: Tree | None, findings: list[Diagnostic], source: SourceFile
) -> tuple[Mapping | None, list[Diagnostic]]:
    if isinstance(tree, Mapping):
        return tree, findings
    if tree is None or (isinstance(tree, Scalar) and tree.value is None):
        message, span, hint = "this file is empty", Span(source, 1, 1), _WHAT_A_FILE_IS
    else:
        message, span, hint = f"expected keys and values, found {described(tree)}", tree.span, None
        if isinstance(tree, Scalar) and ":" in str(tree.value):
            hint = "put a space behind the colon"
    return None, [*findings, Diagnostic(NOT_A_MAP, message, span, hint=hint or _WHAT_A_FILE_IS)]
