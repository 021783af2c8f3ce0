"""Explain errors of the YAML parser, with hints how to fix them.

libyaml and PyYAML's own parser word the same errors differently; the patterns here match both.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import yaml

from composer.base.diagnostics import Diagnostic, Label, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.language.document.builder import Mark, span_at
from composer.language.rules import YAML_SYNTAX

_QUOTE_TEXT = "put the whole text in quotes"
_KEY_AND_VALUE_BEFORE = re.compile(r"\s*(?:- +)*[^\s#][^#]*?:\s+\S")
_COLON_WITHOUT_SPACE = re.compile(r"^\s*(?:- +)*[\w$]+:(?=[^\s/])")
_CLOSING = {"[": "]", "{": "}"}


@dataclass(frozen=True, slots=True)
class _Problem:
    """An error of the parser: its message, where it stopped, and the context it was in."""

    source: SourceFile
    words: str
    context: str
    place: Mark
    began: Mark
    bracket: Span | None

    @property
    def line(self) -> str:
        """The line where the parser stopped."""
        return self.source.line(self.place.line + 1)

    @property
    def before(self) -> str:
        """The part of that line before the error."""
        return self.line[: self.place.column]

    @property
    def character(self) -> str:
        """The character at the error; empty at the end of a line."""
        return self.line[self.place.column : self.place.column + 1]

    @property
    def opening(self) -> str:
        """The first character of the context."""
        line = self.source.line(self.began.line + 1)
        return line[self.began.column : self.began.column + 1]

    def at_error(self, message: str, hint: str | None = None, *related: Label) -> Diagnostic:
        """Return a diagnostic where the parser stopped."""
        place, lines = span_at(self.source, self.place), self.source.lines
        if place.line > len(lines):  # the end, for libyaml, of a file without a last line break
            place = Span(self.source, len(lines), len(lines[-1]) + 1)
        return Diagnostic(YAML_SYNTAX, message, place, related, hint)

    def at_context(self, message: str, hint: str | None = None) -> Diagnostic:
        """Return a diagnostic at the start of the context."""
        return Diagnostic(YAML_SYNTAX, message, span_at(self.source, self.began), (), hint)

    def context_label(self, message: str) -> Label:
        """Return a label at the start of the context."""
        return Label(span_at(self.source, self.began), message)


def explain(
    error: yaml.YAMLError | ValueError, source: SourceFile, bracket: Span | None
) -> Diagnostic:
    """Return the diagnostic for an error of the parser.

    ``bracket`` is the innermost open bracket, if any.
    """
    place = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    if place is None:
        reason = shown(error).replace("\n", " ")
        return Diagnostic(YAML_SYNTAX, f"this is not YAML: {reason}", Span(source, 1, 1))
    problem = _Problem(
        source,
        getattr(error, "problem", None) or "",
        getattr(error, "context", None) or "",
        place,
        getattr(error, "context_mark", None) or place,
        bracket,
    )
    for explanation in _EXPLANATIONS:
        diagnostic = explanation(problem)
        if diagnostic is not None:
            return diagnostic
    return problem.at_error(f"this is not YAML: {shown(problem.words)}")


def _tab(problem: _Problem) -> Diagnostic | None:
    indentation = problem.line[: len(problem.line) - len(problem.line.lstrip())]
    if "\t" not in indentation or problem.place.column > len(indentation):
        return None
    place = Span(problem.source, problem.place.line + 1, indentation.index("\t") + 1)
    hint = "indent with spaces"
    return Diagnostic(YAML_SYNTAX, "this line is indented with a tab", place, hint=hint)


def _open_quote(problem: _Problem) -> Diagnostic | None:
    if "quoted scalar" not in problem.context or "unexpected" not in problem.words:
        return None
    quote = problem.opening
    return problem.at_context("this quote is never closed", f"end the text with another {quote}")


def _escape(problem: _Problem) -> Diagnostic | None:
    if "quoted scalar" not in problem.context and "double-quoted" not in problem.context:
        return None
    message = "this backslash does not start a YAML escape"
    hint = "use single quotes, or write the backslash twice"
    place = problem.before.rfind("\\") if problem.character != "\\" else problem.place.column
    if place < 0:
        return problem.at_error(message, hint)
    span = Span(problem.source, problem.place.line + 1, place + 1)
    return Diagnostic(YAML_SYNTAX, message, span, hint=hint)


def _in_brackets(problem: _Problem) -> Diagnostic | None:
    if "flow" not in problem.context or "node" in problem.context:
        return None
    if problem.character == "{" and problem.before.endswith("$"):
        hint = 'write "${name}": inside braces and brackets it needs quotes'
        return problem.at_error("'${...}' needs quotes here", hint)
    if problem.place.line != problem.began.line or not problem.character:
        return _not_closed(problem, span_at(problem.source, problem.began))
    hint = f"{_QUOTE_TEXT} if it is one; commas separate items"
    return problem.at_error(f"expected ',' or '{_CLOSING.get(problem.opening, '')}' here", hint)


def _not_closed(problem: _Problem, bracket: Span) -> Diagnostic:
    line = problem.source.line(bracket.line)
    opening = line[bracket.column - 1 : bracket.column]
    hint = f"close it with '{_CLOSING.get(opening, '')}', or add a comma"
    return Diagnostic(YAML_SYNTAX, f"this '{opening}' is not closed", bracket, hint=hint)


def _colon(problem: _Problem) -> Diagnostic | None:
    if "mapping values are not allowed" not in problem.words:
        return None
    if _KEY_AND_VALUE_BEFORE.match(problem.before):
        return problem.at_error("a second ':' in one value", f"{_QUOTE_TEXT}: a ': ' makes a key")
    message = "a key is not allowed here"
    hint = "align it with the key before it, or end that key with ':'"
    key = problem.before.lstrip()
    start = len(problem.before) - len(key)
    span = Span(problem.source, problem.place.line + 1, start + 1, max(len(key), 1))
    return Diagnostic(YAML_SYNTAX, message, span, hint=hint)


def _no_colon(problem: _Problem) -> Diagnostic | None:
    if "could not find expected ':'" not in problem.words:
        return None
    match = _COLON_WITHOUT_SPACE.match(problem.source.line(problem.began.line + 1))
    if match is not None:
        span = Span(problem.source, problem.began.line + 1, match.end())
        message = "there is no space after this colon"
        return Diagnostic(YAML_SYNTAX, message, span, hint="write 'key: value'")
    return problem.at_context("this line has no key, or its key no ':'", "write 'key: value'")


def _among_keys(problem: _Problem) -> Diagnostic | None:
    if problem.context != "while parsing a block mapping":
        return None
    if problem.character and problem.character in "]}":
        return problem.at_error(f"this '{problem.character}' closes nothing", "delete it")
    if problem.before.strip():
        return problem.at_error(
            "this stands behind a finished value", f"{_QUOTE_TEXT} if it is one"
        )
    map_begins = problem.context_label("the map begins here")
    if problem.character == "-":
        hint = "indent the item under the key it belongs to"
        return problem.at_error("a list item stands among keys", hint, map_begins)
    message = "this line is not in line with the keys it stands among"
    return problem.at_error(message, "give all keys of a map the same indentation", map_begins)


def _among_items(problem: _Problem) -> Diagnostic | None:
    if problem.context != "while parsing a block collection":
        return None
    list_begins = problem.context_label("the list begins here")
    hint = "begin it with '- ', or indent it as what it belongs to"
    return problem.at_error(
        "this line is in a list, but is not an item of the list", hint, list_begins
    )


def _cannot_start(problem: _Problem) -> Diagnostic | None:
    if "cannot start any token" not in problem.words:
        return None
    if problem.character == "\t":
        return problem.at_error("a tab is not allowed here", "use a space")
    return problem.at_error(f"a value cannot start with '{shown(problem.character)}'", _QUOTE_TEXT)


def _no_content(problem: _Problem) -> Diagnostic | None:
    if "node content" not in problem.words:
        return None
    if not problem.character and problem.bracket is not None:
        return _not_closed(problem, problem.bracket)
    found = f"'{shown(problem.character)}'" if problem.character else "the end of the line"
    return problem.at_error(f"expected a value, found {found}", f"{_QUOTE_TEXT} if it is one")


def _block_text(problem: _Problem) -> Diagnostic | None:
    if "block scalar" not in problem.context:
        return None
    hint = "write '|' or '>' at the end of the line, and the text indented below"
    return problem.at_error("unexpected text after '|' or '>'", hint)


def _after_end(problem: _Problem) -> Diagnostic | None:
    if "<document start>" not in problem.words:
        return None
    hint = "a file is one map of keys and values: 'key: value', with a space after the colon"
    return problem.at_error("the YAML ends before this", hint)


_EXPLANATIONS: tuple[Callable[[_Problem], Diagnostic | None], ...] = (
    _tab,
    _open_quote,
    _escape,
    _in_brackets,
    _colon,
    _no_colon,
    _among_keys,
    _among_items,
    _cannot_start,
    _no_content,
    _block_text,
    _after_end,
)
