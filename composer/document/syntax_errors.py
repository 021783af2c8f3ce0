"""What the YAML parser says, in words that tell how to mend it.

libyaml and PyYAML's own parser say the same things differently; what is looked for here is in the
words of both.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import yaml

from composer.diagnostics import Diagnostic, Label, shown
from composer.document.rules import YAML_SYNTAX
from composer.document.spans import Mark, span_at
from composer.source import SourceFile, Span

_QUOTE_TEXT = "put the whole text in quotes"
_KEY_AND_VALUE_BEFORE = re.compile(r"\s*(?:- +)*[^\s#][^#]*?:\s+\S")
_COLON_WITHOUT_SPACE = re.compile(r"^\s*(?:- +)*[\w$]+:(?=[^\s/])")
_CLOSING = {"[": "]", "{": "}"}


@dataclass(frozen=True, slots=True)
class _Problem:
    """A parser's complaint: its words, the place it gave up at and what it was in then."""

    source: SourceFile
    words: str
    context: str
    place: Mark
    began: Mark
    bracket: Span | None

    @property
    def line(self) -> str:
        """The line the parser gave up in."""
        return self.source.line(self.place.line + 1)

    @property
    def before(self) -> str:
        """The part of that line before the place."""
        return self.line[: self.place.column]

    @property
    def character(self) -> str:
        """The character at the place; empty at the end of a line."""
        return self.line[self.place.column : self.place.column + 1]

    @property
    def opening(self) -> str:
        """The character at which began what the parser was in."""
        line = self.source.line(self.began.line + 1)
        return line[self.began.column : self.began.column + 1]

    def here(self, message: str, hint: str | None = None, *related: Label) -> Diagnostic:
        """Return a diagnostic at the place the parser gave up at."""
        return Diagnostic(YAML_SYNTAX, message, span_at(self.source, self.place), related, hint)

    def there(self, message: str, hint: str | None = None) -> Diagnostic:
        """Return a diagnostic where began what the parser was in."""
        return Diagnostic(YAML_SYNTAX, message, span_at(self.source, self.began), (), hint)

    def beginning(self, message: str) -> Label:
        """Return a label where began what the parser was in."""
        return Label(span_at(self.source, self.began), message)


def explain(
    error: yaml.YAMLError | ValueError, source: SourceFile, bracket: Span | None
) -> Diagnostic:
    """Return the diagnostic for whatever the parser raised.

    ``bracket`` is the innermost one that was open then.
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
    return problem.here(f"this is not YAML: {shown(problem.words)}")


def _tab(problem: _Problem) -> Diagnostic | None:
    indentation = problem.line[: len(problem.line) - len(problem.line.lstrip())]
    if "\t" not in indentation or problem.place.column > len(indentation):
        return None
    place = Span(problem.source, problem.place.line + 1, indentation.index("\t") + 1)
    hint = "indent with spaces"
    return Diagnostic(YAML_SYNTAX, "a tab indents this line", place, hint=hint)


def _open_quote(problem: _Problem) -> Diagnostic | None:
    if "quoted scalar" not in problem.context or "unexpected" not in problem.words:
        return None
    quote = problem.opening
    return problem.there("this quote is never closed", f"end the text with another {quote}")


def _escape(problem: _Problem) -> Diagnostic | None:
    if "quoted scalar" not in problem.context and "double-quoted" not in problem.context:
        return None
    message = "this backslash begins no escape that YAML knows"
    hint = "use single quotes, or write the backslash twice"
    place = problem.before.rfind("\\") if problem.character != "\\" else problem.place.column
    if place < 0:
        return problem.here(message, hint)
    span = Span(problem.source, problem.place.line + 1, place + 1)
    return Diagnostic(YAML_SYNTAX, message, span, hint=hint)


def _in_brackets(problem: _Problem) -> Diagnostic | None:
    if "flow" not in problem.context or "node" in problem.context:
        return None
    if problem.character == "{" and problem.before.endswith("$"):
        hint = 'write "${name}": inside braces and brackets it needs quotes'
        return problem.here("a '${...}' stands here without quotes", hint)
    if problem.place.line != problem.began.line or not problem.character:
        return _not_closed(problem, span_at(problem.source, problem.began))
    hint = f"{_QUOTE_TEXT} if it is one; commas separate items"
    return problem.here(f"expected ',' or '{_CLOSING.get(problem.opening, '')}' here", hint)


def _not_closed(problem: _Problem, bracket: Span) -> Diagnostic:
    line = problem.source.line(bracket.line)
    opening = line[bracket.column - 1 : bracket.column]
    hint = f"close it with '{_CLOSING.get(opening, '')}', or add a comma"
    return Diagnostic(YAML_SYNTAX, f"this '{opening}' is not closed", bracket, hint=hint)


def _colon(problem: _Problem) -> Diagnostic | None:
    if "mapping values are not allowed" not in problem.words:
        return None
    if _KEY_AND_VALUE_BEFORE.match(problem.before):
        return problem.here("a second ':' in one value", f"{_QUOTE_TEXT}: a ': ' makes a key")
    message = "this key stands where none can"
    hint = "line it up with the key before it, or end that one with ':'"
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
        message = "there is no space behind this colon"
        return Diagnostic(YAML_SYNTAX, message, span, hint="write 'key: value'")
    return problem.there("this line has no key, or its key no ':'", "write 'key: value'")


def _among_keys(problem: _Problem) -> Diagnostic | None:
    if problem.context != "while parsing a block mapping":
        return None
    if problem.character and problem.character in "]}":
        return problem.here(f"this '{problem.character}' closes nothing", "delete it")
    if problem.before.strip():
        return problem.here("this stands behind a finished value", f"{_QUOTE_TEXT} if it is one")
    map_begins = problem.beginning("the map begins here")
    if problem.character == "-":
        hint = "indent the item under the key it belongs to"
        return problem.here("a list item stands among keys", hint, map_begins)
    message = "this line is not in line with the keys it stands among"
    return problem.here(message, "give all keys of a map the same indentation", map_begins)


def _among_items(problem: _Problem) -> Diagnostic | None:
    if problem.context != "while parsing a block collection":
        return None
    list_begins = problem.beginning("the list begins here")
    hint = "begin it with '- ', or indent it as what it belongs to"
    return problem.here("this line stands in a list and is no item of it", hint, list_begins)


def _cannot_start(problem: _Problem) -> Diagnostic | None:
    if "cannot start any token" not in problem.words:
        return None
    if problem.character == "\t":
        return problem.here("a tab stands where only spaces can", "use a space")
    return problem.here(f"no value begins with '{shown(problem.character)}'", _QUOTE_TEXT)


def _no_content(problem: _Problem) -> Diagnostic | None:
    if "node content" not in problem.words:
        return None
    if not problem.character and problem.bracket is not None:
        return _not_closed(problem, problem.bracket)
    found = f"'{shown(problem.character)}'" if problem.character else "the end of the line"
    return problem.here(f"expected a value, found {found}", f"{_QUOTE_TEXT} if it is one")


def _block_text(problem: _Problem) -> Diagnostic | None:
    if "block scalar" not in problem.context:
        return None
    hint = "write '|' or '>' at the end of the line, and the text indented below"
    return problem.here("this does not belong behind '|' or '>'", hint)


def _after_end(problem: _Problem) -> Diagnostic | None:
    if "<document start>" not in problem.words:
        return None
    hint = "a file is one map of keys and values: 'key: value', with a space behind the colon"
    return problem.here("the YAML ends before this", hint)


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
