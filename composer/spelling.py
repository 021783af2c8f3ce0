"""The name that a misspelt one was most likely meant to be.

Of a few names all are compared. Of many only those that stand beside it in alphabetical order, read
forwards and backwards: a slip leaves the beginning or the end of a name as it was, and an answer
takes no longer the more names there are.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from functools import lru_cache

#: How alike two names must be, from 0 to 1 (difflib: ratio).
LEAST_LIKENESS = 0.6
#: Longer names are not looked for: comparing takes quadratic time, and ROS allows no more.
LONGEST_NAME = 255

_FEW = 60
_BESIDE = 12  # of many, this many on either side


class Vocabulary:
    """Names that may be meant, in the order in which they are looked through."""

    __slots__ = ("_backwards", "_by_folded", "_forwards", "names")

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(sorted(set(names)))
        self._by_folded = {name.casefold(): name for name in reversed(self.names)}
        self._forwards = sorted(self._by_folded)
        self._backwards = sorted(name[::-1] for name in self._by_folded)

    def close(self, name: str, count: int = 1) -> list[str]:
        """Return up to ``count`` names that ``name`` may have been meant to be, likeliest first."""
        if len(name) > LONGEST_NAME:
            return []
        folded = name.casefold()
        alike = get_close_matches(folded, self._candidates(folded), count, LEAST_LIKENESS)
        return [self._by_folded[match] for match in alike]

    def _candidates(self, folded: str) -> list[str]:
        if len(self._forwards) <= _FEW:
            found: Iterable[str] = self._forwards
        else:
            beside = _beside(folded, self._forwards)
            beside += (name[::-1] for name in _beside(folded[::-1], self._backwards))
            found = dict.fromkeys(beside)
        return [candidate for candidate in found if len(candidate) <= LONGEST_NAME]


@lru_cache(maxsize=16)
def vocabulary(names: tuple[str, ...]) -> Vocabulary:
    """Return the vocabulary of ``names``, made once for the same names: slips come in rows."""
    return Vocabulary(names)


def _beside(name: str, ordered: Sequence[str]) -> list[str]:
    place = bisect_left(ordered, name)
    return list(ordered[max(place - _BESIDE, 0) : place + _BESIDE])
