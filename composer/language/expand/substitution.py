"""Find the references to variables (``${name}``) in a tree, and replace them, within limits."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field
from operator import is_

from composer.base.diagnostics import Diagnostic, Label, Rule, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language import rules
from composer.language.expand.arguments import Scope, Sized
from composer.language.rules import (
    DUPLICATE_KEY,
    MAX_BYTES,
    MAX_COPIES,
    MAX_DEPTH,
    MAX_VALUES,
    TOO_LARGE,
    LimitedDiagnostics,
    Stopped,
)
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree, count_values, describe

_MARK = "${"
_PIECE = re.compile(
    r"(?P<literal>\$\$\{)"  # a literal ``${``
    r"|\$\{(?P<name>[A-Za-z_][A-Za-z0-9_]*)\}"
    r"|\$\{[^}]*\}?"  # a malformed reference
)
#: Depth of the names of nodes, which are checked first.
_KEY_DEPTH = 2


@dataclass(frozen=True, slots=True)
class Reference:
    """A ``${name}`` and its offset in the text. ``name`` is None if it is malformed."""

    name: str | None
    start: int
    written: str


def pieces(text: str) -> list[str | Reference]:
    """Split ``text`` into texts and references. ``$${`` is a literal ``${``."""
    found: list[str | Reference] = []
    end = 0
    for match in _PIECE.finditer(text):
        found.append(text[end : match.start()])
        if match["literal"] is not None:
            found.append(_MARK)
        else:
            found.append(Reference(match["name"], match.start(), match[0]))
        end = match.end()
    found.append(text[end:])
    return [piece for piece in found if piece != ""]


def has_reference(text: str) -> bool:
    """Return whether ``text`` contains a reference or an escape."""
    return _MARK in text


def references(tree: Tree) -> Iterator[str]:
    """Yield the names that the texts of ``tree`` refer to."""
    match tree:
        case Scalar(value=str() as text) if has_reference(text):
            for piece in pieces(text):
                if isinstance(piece, Reference) and piece.name is not None:
                    yield piece.name
        case Sequence():
            for item in tree.items:
                yield from references(item)
        case Mapping():
            for entry in tree:
                yield from references(entry.key)
                yield from references(entry.value)


def _refers(tree: Tree) -> bool:
    """Return whether a text of ``tree`` contains a reference or an escape."""
    match tree:
        case Scalar(value=value):
            return isinstance(value, str) and has_reference(value)
        case Sequence(items=items):
            return any(map(_refers, items))
        case Mapping(entries=entries):
            return any(has_reference(item.name) or _refers(item.value) for item in entries)


@dataclass(slots=True)
class Growth:
    """The size of an expanded file."""

    values: int = 0
    height: int = 0  # the depth of maps and lists
    characters: int = 0
    copies: int = 0


@dataclass(slots=True)
class Substitution:
    """Replaces the variables of one file in its trees, and counts the size."""

    scope: Scope
    diagnostics: LimitedDiagnostics = field(default_factory=LimitedDiagnostics)
    growth: Growth = field(default_factory=Growth)
    unknown: set[str] = field(default_factory=set)  # names of undeclared variables

    def within(self, scope: Scope) -> Substitution:
        """Return a substitution for another scope that shares the counts."""
        return Substitution(scope, self.diagnostics, self.growth, self.unknown)

    def evaluate(self, tree: Tree) -> Sized:
        """Return the value of a name with its variables replaced.

        Values keep the location where they were written. Raises Stopped.
        """
        self.growth.values = self.growth.height = 0
        made = self._made(tree, 0)
        return Sized(made, self.growth.values, self.growth.height)

    def grow(self, values: int, tree: Tree) -> None:
        """Count values that are inserted at ``tree``. Raises Stopped."""
        self.growth.values += values
        if self.growth.values > MAX_VALUES:
            message = f"with its variables expanded, this file has more than {MAX_VALUES:,} values"
            raise self._too_large(tree, message)

    def grow_copies(self, copies: int, tree: Tree) -> None:
        """Count the copies that ``tree`` makes. Raises Stopped."""
        self.growth.copies += copies
        if self.growth.copies > MAX_COPIES:
            message = f"with this, the file makes more than {MAX_COPIES:,} copies"
            raise self._too_large(tree, message, "use fewer values")

    def add(self, tree: Tree, depth: int) -> Tree:
        """Return ``tree``, nested in ``depth`` maps and lists, with its variables replaced.

        Adds to the counts. A tree without variables is returned as it is. Raises Stopped.
        """
        if _refers(tree):
            return self._made(tree, depth)
        self.grow(count_values(tree), tree)
        return tree

    def _made(self, tree: Tree, depth: int) -> Tree:
        """Work as :meth:`add`, and measure the height."""
        match tree:
            case Scalar():
                return self._scalar(tree, depth)
            case Sequence(items=items):
                self.grow(1, tree)
                self.growth.height = max(self.growth.height, depth + 1)
                made = tuple([self._made(item, depth + 1) for item in items])
                return tree if all(map(is_, made, items)) else Sequence(made, tree.span)
            case Mapping():
                return self._mapping(tree, depth)

    def _mapping(self, tree: Mapping, depth: int) -> Mapping:
        self.grow(1 + len(tree.entries), tree)
        self.growth.height = max(self.growth.height, depth + 1)
        values = [self._made(entry.value, depth + 1) for entry in tree.entries]
        keys = [self.key(entry.key) for entry in tree.entries]
        made = tuple(
            [
                entry if key is entry.key and value is entry.value else Entry(key, value)
                for key, value, entry in zip(keys, values, tree.entries, strict=True)
            ]
        )
        if all(map(is_, made, tree.entries)):
            return tree
        self._check_keys(tree, keys)
        return Mapping(made, tree.span)

    def key(self, key: Scalar) -> Scalar:
        """Return a key with its variables replaced, at its location. Raises Stopped."""
        if not isinstance(key.value, str) or not has_reference(key.value):
            return key
        name = self._made(key, _KEY_DEPTH)
        if not isinstance(name, Scalar):
            message = f"'{shown(key.value)}' is {describe(name)}, which cannot be a name"
            self.diagnostics.append(Diagnostic(rules.MALFORMED_VARIABLE, message, key.span))
            return key
        text = name.value if isinstance(name.value, str) else shown(name.value)
        return Scalar(text, key.span, verbatim=False)

    def _check_keys(self, tree: Mapping, keys: list[Scalar]) -> None:
        """Report keys that are equal once their variables are replaced."""
        first: dict[object, Scalar] = {}
        for key, entry in zip(keys, tree.entries, strict=True):
            earlier = first.setdefault(key.value, key)
            if earlier is not key and (key is not entry.key or not earlier.verbatim):
                message = f"the key '{shown(key.value)}' is repeated"
                label = Label(earlier.span, "the other one")
                self.diagnostics.append(Diagnostic(DUPLICATE_KEY, message, key.span, (label,)))

    def _scalar(self, scalar: Scalar, depth: int) -> Tree:
        if not isinstance(scalar.value, str) or not has_reference(scalar.value):
            self.grow(1, scalar)
            return scalar
        match pieces(scalar.value):
            case [Reference() as reference]:
                return self._whole(reference, scalar, depth)
            case parts:
                self.grow(1, scalar)
                text = "".join(self._part(part, scalar) for part in parts)
                return Scalar(text, scalar.span, verbatim=False)

    def _whole(self, reference: Reference, scalar: Scalar, depth: int) -> Tree:
        """Return the value of a scalar that is a single reference."""
        found = self._find(reference, scalar)
        if found is None:
            self.grow(1, scalar)
            return scalar
        self.grow(found.values, scalar)
        self.growth.height = max(self.growth.height, depth + found.height)
        if depth + found.height > MAX_DEPTH:
            raise self._too_large(
                scalar,
                f"with its variables expanded, this is nested more than {MAX_DEPTH} levels deep",
            )
        return found.tree

    def _part(self, part: str | Reference, scalar: Scalar) -> str:
        """Return the text of a part of a scalar."""
        if isinstance(part, str):
            return part
        found = self._find(part, scalar)
        if found is None:
            return part.written
        if not isinstance(found.tree, Scalar):
            kind = "map" if isinstance(found.tree, Mapping) else "list"
            message = f"'{part.written}' is a {kind}, which cannot be inserted into a string"
            self._report(rules.MALFORMED_VARIABLE, message, part, scalar)
            return part.written
        text = found.tree.value if isinstance(found.tree.value, str) else shown(found.tree.value)
        self.growth.characters += len(text)
        if self.growth.characters > MAX_BYTES:
            raise self._too_large(
                scalar, f"variables put more than {MAX_BYTES:,} characters into the file"
            )
        return text

    def _find(self, reference: Reference, scalar: Scalar) -> Sized | None:
        name = reference.name
        if name is None:
            message = f"'{shown(reference.written)}' is not a variable: expected '${{name}}'"
            hint = "write '$${' for a literal '${', and '{...}' for an expression"
            self._report(rules.MALFORMED_VARIABLE, message, reference, scalar, hint)
            return None
        return self.lookup(name, scalar, scalar.part(reference.start, len(reference.written)))

    def lookup(self, name: str, scalar: Scalar, span: Span) -> Sized | None:
        """Return the value of a name that ``scalar`` uses at ``span``; None if it has none."""
        found = self.scope.find(name)
        if not self.scope.declares(name) and self.scope.is_known:
            self.unknown.add(name)
            message = f"there is no {self.scope.word} '{shown(name)}'"
            hint = self.scope.hint(name) or f"declare it under '{self.scope.section}'"
            subject = ("variable", f"{scalar.span.file.path}: {name}")
            self.diagnostics.append(
                Diagnostic(rules.UNKNOWN_VARIABLE, message, span, hint=hint, subjects=(subject,))
            )
        return found

    def _too_large(
        self, tree: Tree, message: str, hint: str = "use shorter values, or fewer variables"
    ) -> Stopped:
        return Stopped(Diagnostic(TOO_LARGE, message, tree.span, hint=hint))

    def _report(
        self,
        rule: Rule,
        message: str,
        reference: Reference,
        scalar: Scalar,
        hint: str | None = None,
    ) -> None:
        span = scalar.part(reference.start, len(reference.written))
        self.diagnostics.append(Diagnostic(rule, message, span, hint=hint))
