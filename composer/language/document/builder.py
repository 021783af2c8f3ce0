"""Build a located tree from YAML events, within limits and without recursion.

Events come from libyaml where PyYAML was built with it, else from PyYAML's own parser. YAML
composers are recursive, and libyaml's crashes the process on deeply nested input. Events come one
by one, so that the builder can stop the parser early. Their marks count from 0, spans from 1.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from typing import Any, Protocol

import yaml

from composer.base.diagnostics import Diagnostic, Label, Rule, line_subject, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.language import rules
from composer.language.document.scalars import NumberRefused, check_value, resolve_plain
from composer.language.rules import MAX_DEPTH, MAX_VALUES, LimitedDiagnostics, Stopped
from composer.language.tree import Entry, Mapping, Scalar, ScalarValue, Sequence, Tree, describe

_BLOCK_STYLES = ("|", ">")
LOADER: type[yaml.SafeLoader | yaml.CSafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class Mark(Protocol):
    """A position in a text, as both parsers give it."""

    @property
    def line(self) -> int:
        """The line, from 0."""

    @property
    def column(self) -> int:
        """The character in the line, from 0."""


def span_at(source: SourceFile, mark: Mark | None, length: int = 1) -> Span:
    """Return the span of ``length`` characters that begins at ``mark``.

    PyYAML's types allow a missing mark, its parsers never return one; the span is then 1:1.
    """
    if mark is None:
        return Span(source, 1, 1, length)
    return Span(source, mark.line + 1, mark.column + 1, length)


def scalar_span(source: SourceFile, event: yaml.ScalarEvent) -> tuple[Span, bool, int]:
    """Return the span of a scalar, whether it is verbatim, and the offset of its content.

    The span of a multi-line scalar ends with its first line.
    """
    begin, end = event.start_mark, event.end_mark
    if begin is None or end is None:
        return span_at(source, begin), False, 0
    row, start = begin.line, begin.column
    length = end.column - start
    verbatim, offset = True, 0
    if end.line != row or event.style in _BLOCK_STYLES:
        length = len(source.line(row + 1).rstrip()) - start
        verbatim = False
    elif event.style:  # else unquoted, thus without escapes
        offset = 1
        verbatim = source.line(row + 1)[start + 1 : end.column - 1] == event.value
    return Span(source, row + 1, start + 1, length if length > 0 else 1), verbatim, offset


def parse_events(text: str) -> Generator[yaml.Event, None, None]:
    """Yield the events of ``text``. Raises yaml.YAMLError; PyYAML's own parser also ValueError."""
    loader = LOADER(text)
    try:
        while (event := loader.get_event()) is not None:
            yield event
    finally:
        loader.dispose()


@dataclass(frozen=True, slots=True)
class _Anchored:
    """The value of an anchor, and the size that each alias adds."""

    tree: Tree
    values: int
    height: int


class _Open:
    """A map or list that is not complete yet."""

    __slots__ = (
        *("anchor", "awaits_value", "entries", "height", "is_flow", "is_map", "items", "key"),
        *("keys", "start", "text_in_braces", "values"),
    )

    def __init__(self, start: Span, is_map: bool, is_flow: bool, anchor: str | None) -> None:
        self.start = start
        self.is_map = is_map
        self.is_flow = is_flow
        self.anchor = anchor
        self.items: list[Tree] = []
        self.entries: list[Entry] = []
        self.keys: dict[str, Scalar] = {}
        self.key: Scalar | None = None  # None for an invalid key, whose value is dropped
        self.awaits_value = False
        self.text_in_braces: Scalar | None = None
        self.values = 1
        self.height = 1

    def tree(self) -> Tree:
        """Return the finished map or list."""
        if self.text_in_braces is not None and len(self.entries) == 1:
            return self.text_in_braces
        if self.is_map:
            first = self.entries[0].key.span if self.entries else self.start
            return Mapping(tuple(self.entries), self.start if self.is_flow else first)
        first = self.items[0].span if self.items else self.start
        return Sequence(tuple(self.items), self.start if self.is_flow else first)


class TreeBuilder:
    """Handles the events of one document; ``root`` is the tree after the last one.

    ``resolve`` returns the value of an unquoted scalar. It raises NumberRefused.
    """

    def __init__(
        self, source: SourceFile, resolve: Callable[[str], ScalarValue] = resolve_plain
    ) -> None:
        self.root: Tree | None = None
        self.diagnostics = LimitedDiagnostics()
        self._source = source
        self._resolve = resolve
        self._open: list[_Open] = []
        self._anchors: dict[str, _Anchored | None] = {}  # None while the value is being read
        self._values = 0
        self._handlers: dict[type[yaml.Event], Callable[[Any], None]] = {
            yaml.ScalarEvent: self._on_scalar,
            yaml.MappingStartEvent: self._on_start,
            yaml.MappingEndEvent: self._on_end,
            yaml.SequenceStartEvent: self._on_start,
            yaml.SequenceEndEvent: self._on_end,
            yaml.AliasEvent: self._on_alias,
            yaml.DocumentStartEvent: self._on_document,
        }

    @property
    def open_bracket(self) -> Span | None:
        """The location of the innermost '[' or '{' that has not been closed."""
        return next((part.start for part in reversed(self._open) if part.is_flow), None)

    def handle(self, events: Iterable[yaml.Event]) -> None:
        """Handle the events of a text. Raises Stopped."""
        handlers = self._handlers
        for event in events:
            if (handler := handlers.get(type(event))) is not None:
                handler(event)

    def _on_document(self, event: yaml.DocumentStartEvent) -> None:
        if self.root is None:
            return
        span = span_at(self._source, event.start_mark, 3)
        message = "a second document starts here"
        hint = "put each system or node type into its own file"
        raise Stopped(Diagnostic(rules.YAML_SYNTAX, message, span, hint=hint))

    def _on_scalar(self, event: yaml.ScalarEvent) -> None:
        self._count(1, event.start_mark)
        scalar = self._scalar(event)
        if event.anchor is not None:
            self._anchors[event.anchor] = _Anchored(scalar, 1, 0)
        parent = self._open[-1] if self._open else None
        if parent is None or not parent.is_map or parent.awaits_value:
            self._add(scalar, 1, 0)
            if parent is not None and parent.is_flow and scalar.value is None:
                self._check_value_in_braces(parent, scalar)
            return
        parent.values += 1
        parent.awaits_value = True
        parent.key = self._key(scalar, event, parent)

    def _on_start(self, event: yaml.CollectionStartEvent) -> None:
        self._count(1, event.start_mark)
        if event.tag is not None:
            self._report_tag(event.tag, event.start_mark)
        is_map = isinstance(event, yaml.MappingStartEvent)
        start = span_at(self._source, event.start_mark)
        if len(self._open) >= MAX_DEPTH:
            message = f"maps and lists are nested more than {MAX_DEPTH} levels deep"
            raise Stopped(Diagnostic(rules.TOO_LARGE, message, start))
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        self._open.append(_Open(start, is_map, bool(event.flow_style), event.anchor))

    def _on_end(self, _: yaml.CollectionEndEvent) -> None:
        ended = self._open.pop()
        tree = ended.tree()
        if ended.anchor is not None:
            self._anchors[ended.anchor] = _Anchored(tree, ended.values, ended.height)
        self._add(tree, ended.values, ended.height)

    def _on_alias(self, event: yaml.AliasEvent) -> None:
        anchor = event.anchor or ""
        name = shown(anchor)
        span = span_at(self._source, event.start_mark, len(anchor) + 1)
        anchored = self._anchors.get(anchor)
        if anchored is None:
            inside = anchor in self._anchors
            message = (
                f"'*{name}' is part of the value that it repeats" if inside else _undefined(name)
            )
            hint = None if inside else f"mark the value with '&{name}', or quote the text"
            raise Stopped(Diagnostic(rules.UNSUPPORTED_YAML, message, span, hint=hint))
        if self._open and self._open[-1].is_map and not self._open[-1].awaits_value:
            message = f"found the alias '*{name}', expected a key"
            raise Stopped(
                Diagnostic(rules.UNSUPPORTED_YAML, message, span, hint="write out the key")
            )
        self._count(anchored.values, event.start_mark)
        if len(self._open) + anchored.height > MAX_DEPTH:
            message = f"with '*{name}', values are nested more than {MAX_DEPTH} levels deep"
            raise Stopped(Diagnostic(rules.TOO_LARGE, message, span))
        self._add(anchored.tree, anchored.values, anchored.height)

    def _add(self, tree: Tree, values: int, height: int) -> None:
        """Add a complete value to its parent."""
        if not self._open:
            self._finish(tree)
            return
        parent = self._open[-1]
        parent.values += values
        if parent.height <= height:
            parent.height = height + 1
        if not parent.is_map:
            parent.items.append(tree)
        elif parent.awaits_value:
            if parent.key is not None:
                parent.entries.append(Entry(parent.key, tree))
            parent.awaits_value = False
        else:
            hint = "quote a string with braces or brackets"
            self._report(
                rules.UNSUPPORTED_YAML,
                f"a key must be a string, found {describe(tree)}",
                tree.span,
                hint,
            )
            parent.awaits_value, parent.key = True, None

    def _finish(self, tree: Tree) -> None:
        self.root = tree

    def _scalar(self, event: yaml.ScalarEvent) -> Scalar:
        if event.tag is not None:
            self._report_tag(event.tag, event.start_mark)
        span, verbatim, offset = scalar_span(self._source, event)
        value: ScalarValue = event.value
        if not event.style:  # unquoted: None from PyYAML's parser, "" from libyaml's
            if event.tag is None:
                value = self._plain(event.value, span)
        else:
            value, diagnostics = check_value(event.value, span)
            self.diagnostics += diagnostics
        return Scalar(value, span, verbatim, offset)

    def _plain(self, text: str, span: Span) -> ScalarValue:
        try:
            return self._resolve(text)
        except NumberRefused as refusal:
            hint = "leave the key out for no limit; quote the value if it is a string"
            self._report(rules.BAD_NUMBER, f"'{shown(text)}' {refusal}", span, hint)
            return 1  # a placeholder, so that no other diagnostic follows

    def _key(self, scalar: Scalar, event: yaml.ScalarEvent, parent: _Open) -> Scalar | None:
        if scalar.value == "<<" and not event.style:
            hint = "write out the keys; put what nodes share into a node type or qos_profiles"
            self._report(
                rules.UNSUPPORTED_YAML, "YAML merge keys are not supported", scalar.span, hint
            )
            return None
        if scalar.value is None and not event.value:
            self._report(
                rules.UNSUPPORTED_YAML, "a key is missing before this ':'", scalar.span, None
            )
            return None
        key = scalar
        if not isinstance(scalar.value, str):
            text = shown(event.value)
            message = f"a key must be a string, found {describe(scalar)}"
            self._report(rules.UNSUPPORTED_YAML, message, scalar.span, f"quote it: '{text}'")
            key = Scalar(event.value, scalar.span, scalar.verbatim, scalar.content_offset)
        first = parent.keys.setdefault(str(key.value), key)
        if first is key:
            return key
        label = Label(first.span, "first here")
        message = f"duplicate key '{shown(key.value)}'"
        hint = "rename one of them, or merge their values"
        self.diagnostics.append(Diagnostic(rules.DUPLICATE_KEY, message, key.span, (label,), hint))
        return None

    def _check_value_in_braces(self, parent: _Open, value: Scalar) -> None:
        """Report ``{message.data}`` and ``{rate_hz:10}``: to YAML, keys without values."""
        key = parent.key
        if not parent.is_map or key is None or key.content_offset or not key.verbatim:
            return
        if _follows_colon(self._source.line(value.span.line), value.span.column - 1):
            return
        name, colon, rest = str(key.value).partition(":")
        if colon and name and rest and name.isidentifier():
            message = f"there is no space after the colon of '{shown(key.value)}'"
            hint = f"write '{shown(f'{name}: {rest}')}'"
            self._report(rules.KEY_WITHOUT_VALUE, message, key.span, hint)
            value = Scalar(self._plain(rest, key.span), key.part(len(name) + 1, len(rest)))
            parent.entries[-1] = Entry(Scalar(name, key.part(0, len(name))), value)
            return
        text = f"{{{key.value}}}"
        message = f"'{shown(text)}' is a map whose key has no value"
        hint = f'quote it if it is an expression: "{shown(text)}"'
        if str(key.value).endswith("$"):
            message = "'${...}' needs quotes here"
            hint = f'write "{shown(key.value)}{{name}}": inside braces it needs quotes'
        self._report(rules.KEY_WITHOUT_VALUE, message, key.span, hint)
        parent.text_in_braces = Scalar(text, parent.start, verbatim=False)

    def _report_tag(self, tag: str, mark: Mark | None) -> None:
        hint = "remove it, and quote the value if it is a string"
        message = f"the tag '{shown(tag.replace('tag:yaml.org,2002:', '!!'))}' is not supported"
        self._report(rules.UNSUPPORTED_YAML, message, span_at(self._source, mark), hint)

    def _count(self, values: int, mark: Mark | None) -> None:
        self._values += values
        if self._values > MAX_VALUES:
            message = f"this file has more than {MAX_VALUES:,} values"
            span = span_at(self._source, mark)
            raise Stopped(Diagnostic(rules.TOO_LARGE, message, span))

    def _report(self, rule: Rule, message: str, span: Span, hint: str | None) -> None:
        # What else is reported on the line of a key without its value may follow from it.
        lines = (line_subject(span),) if rule is rules.KEY_WITHOUT_VALUE else ()
        self.diagnostics.append(Diagnostic(rule, message, span, hint=hint, subjects=lines))


def _follows_colon(line: str, end: int) -> bool:
    """Return whether the last character before ``end``, apart from blanks, is a colon."""
    while end > 0 and line[end - 1].isspace():
        end -= 1
    return line[end - 1 : end] == ":"


def _undefined(name: str) -> str:
    return f"'*{name}' is an alias, but no value before it is marked '&{name}'"
