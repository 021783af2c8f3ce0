"""Find the name that a misspelled one was most likely meant to be.

Few names are all compared. Of many names, only those next to it in alphabetical order are, read
forwards and backwards: most typos leave the beginning or the end of a name unchanged, and the time
hardly grows with the number of names.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from functools import lru_cache

#: Minimum similarity of two names, from 0 to 1 (difflib's ratio).
LEAST_LIKENESS = 0.6
#: Longer names are skipped: comparing takes quadratic time, and ROS allows no longer ones.
LONGEST_NAME = 255

_FEW = 60
_NEIGHBORS = 12  # number of candidates on each side, of many names


class Vocabulary:
    """Candidates for misspelled names."""

    __slots__ = ("_backwards", "_by_folded", "_forwards", "names")

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(sorted(set(names)))
        self._by_folded = {name.casefold(): name for name in reversed(self.names)}
        self._forwards = sorted(self._by_folded)
        self._backwards = sorted(name[::-1] for name in self._by_folded)

    def close(self, name: str, count: int = 1) -> list[str]:
        """Return up to ``count`` names similar to ``name``, most similar first."""
        if len(name) > LONGEST_NAME:
            return []
        folded = name.casefold()
        alike = get_close_matches(folded, self._candidates(folded), count, LEAST_LIKENESS)
        return [self._by_folded[match] for match in alike]

    def _candidates(self, folded: str) -> list[str]:
        if len(self._forwards) <= _FEW:
            found: Iterable[str] = self._forwards
        else:
            neighbors = _neighbors(folded, self._forwards)
            neighbors += (name[::-1] for name in _neighbors(folded[::-1], self._backwards))
            found = dict.fromkeys(neighbors)
        return [candidate for candidate in found if len(candidate) <= LONGEST_NAME]


@lru_cache(maxsize=16)
def vocabulary(names: tuple[str, ...]) -> Vocabulary:
    """Return the vocabulary of ``names``, cached, since typos often repeat."""
    return Vocabulary(names)


def _neighbors(name: str, ordered: Sequence[str]) -> list[str]:
    place = bisect_left(ordered, name)
    return list(ordered[max(place - _NEIGHBORS, 0) : place + _NEIGHBORS])
