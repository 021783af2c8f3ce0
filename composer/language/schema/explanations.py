"""Explain errors of a schema in terms of the language, with their locations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field
from itertools import islice

from composer.base.diagnostics import Diagnostic, Label, line_subject, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language import rules
from composer.language.rules import MAX_ERRORS, LimitedDiagnostics, TooManyErrors
from composer.language.schema.hints import (
    EXAMPLES,
    advice,
    expected,
    intended_key,
    other_section,
    type_hint,
    value_advice,
)
from composer.language.schema.validation import Path, SchemaError
from composer.language.tree import Entry, Mapping, Scalar, Tree, describe, entries, items

#: Keys that determine which other keys are valid, and the titles of schemas that have them.
_DECIDING = frozenset({"type", "topic", "service", "action"})
_DECIDED = frozenset({"inline node", "connection"})

#: The ends of each form of connection, by the title of its schema.
_ENDS = {
    "topic connection": ("from", "to"),
    "service connection": ("server", "clients"),
    "action connection": ("server", "clients"),
}

_WORDS_FOR_NOTHING = ("null", "~")
_LIMITS = {"minimum": "at least", "maximum": "at most", "exclusiveMinimum": "a number above"}


@dataclass(slots=True)
class _TreeIndex:
    """Finds values by path, with an index of the keys of each map."""

    root: Mapping
    _entries: dict[int, dict[str, Entry]] = field(default_factory=dict)

    def find(self, path: Path) -> tuple[Tree, Scalar | None]:
        """Return the value at ``path``, which must exist, and its key."""
        tree: Tree = self.root
        key = None
        for step in path:
            if isinstance(step, str):
                entry = self.entries(tree)[step]
                tree, key = entry.value, entry.key
            else:
                tree, key = items(tree)[step], None
        return tree, key

    def entries(self, tree: Tree) -> dict[str, Entry]:
        """Return the entries of a map by name; none for anything else."""
        # By identity, since comparing trees is slow; the root keeps them all alive.
        if id(tree) not in self._entries:
            self._entries[id(tree)] = {entry.name: entry for entry in entries(tree)}
        return self._entries[id(tree)]


@dataclass(frozen=True, slots=True)
class _LocatedError(SchemaError):
    """An error with its location in the tree."""

    tree: Tree
    key: Scalar | None  # None for the root and for items of lists
    index: _TreeIndex

    @property
    def owner(self) -> str:
        """The name of the value for messages: ``timer 'tick'``."""
        title = self.schema.get("title")
        name = self.path[-1] if self.path else None
        if title is None:
            return f"'{shown(name)}'" if isinstance(name, str) else "this"
        if not isinstance(name, str) or name == title:
            return f"a {title}" if not self.path else f"this {title}"
        return f"{title} '{shown(name)}'"

    @property
    def owner_span(self) -> Span:
        """The location of the value or its key; for a whole file, of its first key."""
        first = next(iter(self.index.root), None)
        if not self.path and first is not None:
            return first.key.span
        return self.key.span if self.key is not None else self.tree.span

    @property
    def value_span(self) -> Span:
        """The location of the value, or of its key if the value is empty."""
        span = self.tree.span
        if self.key is None or not isinstance(self.tree, Scalar) or self.tree.value is not None:
            return span
        written = span.file.line(span.line)[span.column - 1 :]
        return span if written.lower().startswith(_WORDS_FOR_NOTHING) else self.key.span

    @property
    def subject(self) -> str:
        """The key of a value of the wrong type, for messages: `` for 'period_ms'``."""
        if not self.path:
            return ""
        if isinstance(self.path[-1], str):
            return f" for '{shown(self.path[-1])}'"
        return f" in '{shown(self.path[-2])}'" if len(self.path) > 1 else ""

    @property
    def unknown(self) -> list[str]:
        """The keys that the schema does not have."""
        unknown = (key for key in self.instance if key not in self.schema["properties"])
        return list(islice(unknown, MAX_ERRORS + 1))


@dataclass(frozen=True, slots=True)
class _MisspelledKeys:
    """The intended names of misspelled keys, to avoid follow-up errors."""

    keys: set[tuple[Path, str]]
    deciding: set[Path]  # where the intended key determines which other keys are valid
    missing: dict[Path, str]  # the one required key that is missing where one key is unknown

    @classmethod
    def among(cls, errors: Sequence[_LocatedError]) -> _MisspelledKeys:
        keys = set()
        deciding = set()
        unknown = [item for item in errors if item.keyword == "additionalProperties"]
        single = {item.path for item in unknown if len(item.unknown) == 1}
        missing = {
            item.path: names[0]
            for item in errors
            if item.keyword == "required" and item.path in single
            if len(names := [name for name in item.required if name not in item.instance]) == 1
        }
        for error in errors:
            if error.keyword != "additionalProperties":
                continue
            found = {_intended_key(error, name) for name in error.unknown} - {None}
            keys |= {(error.path, str(key)) for key in found}
            if error.schema.get("title") in _DECIDED and found & _DECIDING:
                deciding.add(error.path)
        return cls(keys, deciding, missing)

    def covers(self, error: _LocatedError) -> bool:
        """Return whether ``error`` may only follow from a misspelled key."""
        if error.keyword == "additionalProperties" and error.path in self.deciding:
            return False
        return bool(self.deciding) and any(
            error.path[:length] in self.deciding for length in range(1, len(error.path) + 1)
        )


def explain_errors(errors: Iterable[SchemaError], tree: Mapping) -> list[Diagnostic]:
    """Return the diagnostics for ``errors`` of ``tree``, without those that follow from another."""
    index = _TreeIndex(tree)
    located = [_located(error, index) for error in islice(errors, MAX_ERRORS + 1)]
    misspelled = _MisspelledKeys.among(located)
    diagnostics = LimitedDiagnostics()
    try:
        for error in located:
            if not misspelled.covers(error):
                diagnostics += _EXPLAINERS[error.keyword](error, misspelled)
    except TooManyErrors as stopped:
        return stopped.diagnostics
    return list(dict.fromkeys(diagnostics))


def _located(error: SchemaError, index: _TreeIndex) -> _LocatedError:
    return _LocatedError(
        error.path,
        error.keyword,
        error.required,
        error.instance,
        error.schema,
        *index.find(error.path),
        index,
    )


def _intended_key(error: _LocatedError, name: str) -> str | None:
    key = intended_key(name, error.schema["properties"])
    return key if key is not None and key not in error.instance else None


def _unknown_keys(error: _LocatedError, misspelled: _MisspelledKeys) -> Iterator[Diagnostic]:
    entries = error.index.entries(error.tree)
    if _has_other_ends(error):
        yield _other_ends(error, entries)
        return
    valid, title = error.schema["properties"], error.schema.get("title", "")
    unused = [key for key in valid if key not in error.instance]
    for name in error.unknown:
        if error.path in misspelled.deciding and _intended_key(error, name) not in _DECIDING:
            continue
        message = f"'{shown(name)}' is not a key of {error.owner}"
        hint = advice(name, title, unused)
        meant = _intended_key(error, name)
        needed = misspelled.missing.get(error.path)
        if needed is not None and f"'{needed}'" not in str(hint):
            hint = f"it needs the key '{needed}'"
        subjects = () if meant is None else (("key", meant),)
        if other_section(name, title) is not None:  # what follows is about a port of the wrong kind
            subjects = (line_subject(error.owner_span),)
        span = entries[name].key.span
        yield Diagnostic(rules.UNKNOWN_KEY, message, span, hint=hint, subjects=subjects)


def _has_other_ends(error: _LocatedError) -> bool:
    """Return whether a connection only has ends of another form: a topic with a server."""
    title = error.schema.get("title", "")
    if title not in _ENDS:
        return False
    others = {end for ends in _ENDS.values() for end in ends} - set(_ENDS[title])
    found = others.intersection(error.instance)
    # A single key may also be a slip.
    is_meant = len(found) > 1 or (title == "topic connection" and len(found) == 1)
    return is_meant and set(_ENDS[title]).isdisjoint(error.instance)


def _other_ends(error: _LocatedError, entries: dict[str, Entry]) -> Diagnostic:
    """Report the key with the name of a connection that has the ends of another form."""
    title = error.schema["title"]
    kind = title.removesuffix(" connection")
    given = [end for end in dict.fromkeys(sum(_ENDS.values(), ())) if end in error.instance]
    ends = " and ".join(f"'{end}'" for end in given)
    own = " and ".join(f"'{end}'" for end in _ENDS[title])
    fitting = [name for name in _ENDS if given[0] in _ENDS[name]]
    forms = " or ".join(f"'{name.removesuffix(' connection')}'" for name in fitting)
    article = "an" if kind == "action" else "a"
    message = f"{article} {title} has {own}, not {ends}"
    hint = f"write {forms} instead of '{kind}', or {own}"
    return Diagnostic(rules.UNKNOWN_KEY, message, entries[kind].key.span, hint=hint)


def _missing_keys(error: _LocatedError, misspelled: _MisspelledKeys) -> Iterator[Diagnostic]:
    if error.path in misspelled.missing:
        return
    for name in error.required:
        if name not in error.instance and (error.path, name) not in misspelled.keys:
            yield _needed(error, f"the key '{name}'", name)


def _missing_choice(error: _LocatedError, misspelled: _MisspelledKeys) -> Iterator[Diagnostic]:
    names = [name for choice in error.required for name in choice["required"]]
    if _has_other_ends(error):
        return
    if not any((error.path, name) in misspelled.keys for name in names):
        yield _needed(error, _any_of(names), names[0])


def _needed(error: _LocatedError, what: str, name: str) -> Diagnostic:
    """Return that a map needs ``what``, with an example for the key ``name``."""
    example = EXAMPLES.get((error.schema.get("title", ""), name))
    hint = f"for example '{name}: {example}'" if example is not None else None
    message = f"{error.owner} needs {what}"
    return Diagnostic(rules.MISSING_KEY, message, error.owner_span, hint=hint)


def _excluding_keys(error: _LocatedError, _: _MisspelledKeys) -> Iterator[Diagnostic]:
    entries = error.index.entries(error.tree)
    first, second = sorted(
        (entries[name].key for name in error.required["required"]),
        key=lambda key: (key.span.line, key.span.column),
    )
    message = f"{error.owner} has both '{first.value}' and '{second.value}'"
    label = Label(first.span, "the other one")
    hint = "keep one of them"
    yield Diagnostic(rules.KEYS_EXCLUDE_EACH_OTHER, message, second.span, (label,), hint)


def _wrong_type(error: _LocatedError, _: _MisspelledKeys) -> Iterator[Diagnostic]:
    required = expected(error.schema)
    found = describe(error.tree)
    message = f"expected {required}{error.subject}, found {found}"
    hint = value_advice(error.path, error.instance) or type_hint(error.schema, error.instance)
    yield Diagnostic(rules.WRONG_TYPE, message, error.value_span, hint=hint)


def _unknown_word(error: _LocatedError, _: _MisspelledKeys) -> Iterator[Diagnostic]:
    return _no_word_of(error, error.required)


def _no_word_or_variable(error: _LocatedError, _: _MisspelledKeys) -> Iterator[Diagnostic]:
    """Explain a value of ``oneOf: [{enum: ...}, a variable]``."""
    return _no_word_of(error, [word for part in error.required for word in part.get("enum", ())])


def _no_word_of(error: _LocatedError, words: list[str]) -> Iterator[Diagnostic]:
    found = describe(error.tree)
    message = f"expected {_any_of(words)}{error.subject}, found {found}"
    hint = suggestion(error.instance, words, limit=0) if isinstance(error.instance, str) else None
    hint = hint or value_advice(error.path, error.instance)
    yield Diagnostic(rules.UNKNOWN_WORD, message, error.value_span, hint=hint)


def _out_of_range(error: _LocatedError, _: _MisspelledKeys) -> Iterator[Diagnostic]:
    limit = f"{_LIMITS[error.keyword]} {error.required}"
    message = f"expected {limit}{error.subject}, found {shown(error.instance)}"
    yield Diagnostic(rules.OUT_OF_RANGE, message, error.value_span)


def _empty_collection(error: _LocatedError, _: _MisspelledKeys) -> Iterator[Diagnostic]:
    name = error.path[-1] if error.path else "this"
    least, found = error.required, len(error.instance)
    message, hint = f"'{shown(name)}' is empty", "add at least one"
    if least > 1:
        entries = "is empty" if not found else f"has only {found}"
        message = f"'{shown(name)}' needs at least {least} entries, and {entries}"
        hint = f"add {least - found} or more"
    yield Diagnostic(rules.EMPTY_COLLECTION, message, error.owner_span, hint=hint)


def _any_of(names: Iterable[str]) -> str:
    *most, last = (f"'{name}'" for name in names)
    return f"{', '.join(most)} or {last}" if most else last


_EXPLAINERS: dict[str, Callable[[_LocatedError, _MisspelledKeys], Iterator[Diagnostic]]] = {
    "additionalProperties": _unknown_keys,
    "required": _missing_keys,
    "anyOf": _missing_choice,
    "not": _excluding_keys,
    "type": _wrong_type,
    "pattern": _wrong_type,
    "enum": _unknown_word,
    "oneOf": _no_word_or_variable,
    **dict.fromkeys(_LIMITS, _out_of_range),
    "minItems": _empty_collection,
    "minProperties": _empty_collection,
}

#: The keywords with an explanation. A test checks that these are all keywords of the schemas.
KEYWORDS = frozenset(_EXPLAINERS)
