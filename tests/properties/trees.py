"""Located trees that hypothesis draws."""

from __future__ import annotations

from hypothesis import strategies as st

from composer.base.source import SourceFile, Span
from composer.language.tree import Entry, Mapping, Scalar, ScalarValue, Sequence, Tree

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
