"""Located trees, and mutations of valid files: keys and values are removed, moved and replaced."""

from __future__ import annotations

import copy
from typing import Any

from hypothesis import strategies as st

from composer.base.source import SourceFile, Span
from composer.language.tree import Entry, Mapping, Scalar, ScalarValue, Sequence, Tree

#: Replacement values, mostly of a wrong type.
VALUES: st.SearchStrategy[Any] = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(
        ["", "a", "/", "~", "a b", "../a", "${a}", "{", "{message.data}", "{1 // 0}", "a.b", "a:b"]
    ),
    st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=20),
    st.just([]),
    st.just({}),
    st.just([[]]),
    st.just({"a": {}}),
)


@st.composite
def mutated(draw: st.DrawFn, content: Any) -> Any:
    """Return ``content`` with one to four mutations."""
    changed = copy.deepcopy(content)
    for _ in range(draw(st.integers(1, 4))):
        places = list(_containers(changed))
        container = draw(st.sampled_from(places))
        _CHANGES[draw(st.sampled_from(sorted(_CHANGES)))](draw, container, places)
    return changed


def _containers(part: Any) -> list[Any]:
    """Return all maps and lists that are not empty, or else the content itself."""
    containers = []
    waiting = [part]
    while waiting:
        current = waiting.pop()
        inner = list(current.values()) if isinstance(current, dict) else list(current)
        if inner:
            containers.append(current)
        waiting.extend(item for item in inner if isinstance(item, dict | list))
    return containers or [part]


def _pick(draw: st.DrawFn, container: Any) -> Any:
    """Return a key or an index of ``container``, or None if it is empty."""
    keys = list(container) if isinstance(container, dict) else list(range(len(container)))
    return draw(st.sampled_from(keys)) if keys else None


def _remove(draw: st.DrawFn, container: Any, _: list[Any]) -> None:
    key = _pick(draw, container)
    if key is not None:
        del container[key]


def _replace(draw: st.DrawFn, container: Any, _: list[Any]) -> None:
    key = _pick(draw, container)
    if key is not None:
        container[key] = copy.deepcopy(draw(VALUES))  # may be mutated later


def _rename(draw: st.DrawFn, container: Any, places: list[Any]) -> None:
    key = _pick(draw, container)
    if not isinstance(key, str) or not isinstance(container, dict):
        return
    others = [name for place in places if isinstance(place, dict) for name in place]
    misspelled = [key[1:], key + "s", key.upper(), key.replace("_", "-"), key[::-1], ""]
    container[draw(st.sampled_from([*others, *misspelled]))] = container.pop(key)


def _move(draw: st.DrawFn, container: Any, places: list[Any]) -> None:
    """Replace a value with a copy of another value."""
    other = draw(st.sampled_from(places))
    key, source = _pick(draw, container), _pick(draw, other)
    if key is not None and source is not None:
        container[key] = copy.deepcopy(other[source])


def _spoil(draw: st.DrawFn, container: Any, _: list[Any]) -> None:
    """Change a few characters of a string."""
    key = _pick(draw, container)
    text = container[key] if key is not None else None
    if isinstance(text, str):
        start = draw(st.integers(0, len(text)))
        end = draw(st.integers(start, min(len(text), start + 3)))
        inserted = draw(st.text("abz019_./~{}()[]'\"+-*% :#$\u00e9\u4e00", max_size=4))
        container[key] = text[:start] + inserted + text[end:]


_CHANGES = {
    "remove": _remove,
    "move": _move,
    "rename": _rename,
    "replace": _replace,
    "spoil": _spoil,
}


#: Text that means something to one of the parsers.
_PIECES = (
    *"\"'\\[]{}(),.:;#=-+*&!|>%@`~/ \t\n\r\x00\x1b\u202e\ufeff",
    *("'" * 3, '"' * 3, "${", "$${", "---", "1e999", ".nan", "0x", "<=", "null"),
    *("9" * 200, "9" * 5000, ".a" * 700, "[" * 700),
)


@st.composite
def spliced(draw: st.DrawFn, texts: list[str]) -> str:
    """Draw one of ``texts`` with lines removed, duplicated, moved and indented, or characters."""
    lines = draw(st.sampled_from(texts)).splitlines(keepends=True)
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(lines)))
        end = draw(st.integers(start, min(start + 4, len(lines))))
        piece = lines[start:end]
        match draw(st.sampled_from(["remove", "duplicate", "move", "indent", "insert", "write"])):
            case "remove":
                lines[start:end] = []
            case "duplicate":
                lines[start:start] = piece
            case "move":
                lines[start:end] = []
                place = draw(st.integers(0, len(lines)))
                lines[place:place] = piece
            case "indent":
                lines[start:end] = [f"  {line}" for line in piece]
            case "insert":
                other = draw(st.sampled_from(texts)).splitlines(keepends=True)
                lines[start:start] = draw(st.lists(st.sampled_from(other), max_size=3))
            case "write" if piece:
                place = draw(st.integers(0, len(piece[0])))
                written = "".join(draw(st.lists(st.sampled_from(_PIECES), max_size=4)))
                rest = piece[0][place + draw(st.integers(0, 4)) :]
                lines[start] = f"{piece[0][:place]}{written}{rest}"
    return "".join(lines)


SOURCE = SourceFile("robot.yaml", "")
SPAN = Span(SOURCE, 1, 1)


def maps(
    keys: st.SearchStrategy[str], values: st.SearchStrategy[Tree], most: int
) -> st.SearchStrategy[Mapping]:
    """Draw maps of at most ``most`` entries."""
    return st.dictionaries(keys, values, max_size=most).map(
        lambda items: Mapping(
            tuple(Entry(Scalar(name, SPAN), value) for name, value in items.items()), SPAN
        )
    )


def trees(
    keys: st.SearchStrategy[str], scalars: st.SearchStrategy[ScalarValue], most: int, leaves: int
) -> st.SearchStrategy[Tree]:
    """Draw trees of about ``leaves`` scalars, in maps and lists of at most ``most``."""

    def lists(inner: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
        return st.lists(inner, max_size=most).map(lambda items: Sequence(tuple(items), SPAN))

    return st.recursive(
        scalars.map(lambda value: Scalar(value, SPAN)),
        lambda inner: maps(keys, inner, most) | lists(inner),
        max_leaves=leaves,
    )
