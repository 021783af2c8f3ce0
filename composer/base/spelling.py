"""Find the name that a misspelled one was most likely meant to be.

Few names are all compared. Of many names, only those next to it in alphabetical order are, read
forwards and backwards: most typos leave the beginning or the end of a name unchanged, and the time
hardly grows with the number of names.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Sequence
from difflib import SequenceMatcher
from functools import lru_cache
from heapq import nlargest

#: Minimum similarity of two names, from 0 to 1 (difflib's ratio).
LEAST_LIKENESS = 0.6
#: Longer names are skipped: comparing takes quadratic time, and ROS allows no longer ones.
LONGEST_NAME = 255

_FEW = 60
_NEIGHBORS = 12  # number of candidates on each side, of many names
_MAX_MEANT = 3  # similar names that one may be a typo of
#: Letters of all candidates, of which there are at least two.
_MAX_LETTERS = 2400
#: Pairs of equal letters of a name and its candidates. Comparing takes time for each.
_MAX_PAIRS = 4000


#: Shortest word in which one wrong letter is a typo: camera_l and camera_r are two cameras.
_SHORTEST_TYPO = 4
_SWAPPED = 2
_WORD = re.compile(r"[^\W\d_]+")


def is_typo(name: str, other: str) -> bool:
    """Return whether one letter of a longer word of ``name`` is wrong, missing, surplus or swapped.

    Names that differ in a digit, or at the end as singular and plural do, are different on purpose.
    """
    if abs(len(name) - len(other)) > 1:
        return False
    start = _shared(name, other)
    end = _shared(name[start:][::-1], other[start:][::-1])
    parts = (name[start : len(name) - end], other[start : len(other) - end])
    in_word = _is_in_long_word(name, start) or _is_in_long_word(other, start)
    if not in_word or not all(map(_is_letters, parts)):
        return False
    if len(name) == len(other):
        return len(parts[0]) == 1 or (len(parts[0]) == _SWAPPED and parts[0] == parts[1][::-1])
    return end > 0 and max(map(len, parts)) == 1


def edit_distance(name: str, other: str) -> int:
    """Return how many letters to insert, remove, replace or swap to get the other name."""
    rows = [list(range(len(other) + 1))]
    for row, letter in enumerate(name):
        current = [row + 1]
        for column, wanted in enumerate(other):
            costs = [current[-1] + 1, rows[-1][column + 1] + 1]
            costs.append(rows[-1][column] + (letter != wanted))
            if row and column and (letter, name[row - 1]) == (other[column - 1], wanted):
                costs.append(rows[-2][column - 1] + 1)
            current.append(min(costs))
        rows.append(current)
    return rows[-1][-1]


def _shared(name: str, other: str) -> int:
    """Return the number of letters that the names have in common at the start."""
    pairs = enumerate(zip(name, other, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(name), len(other)))


def _is_in_long_word(name: str, at: int) -> bool:
    words = (word for word in _WORD.finditer(name) if word.start() <= at <= word.end())
    return any(len(word[0]) >= _SHORTEST_TYPO for word in words)


def _is_letters(part: str) -> bool:
    return all(letter.isalpha() or letter == "_" for letter in part)


class Vocabulary:
    """Candidates for misspelled names."""

    __slots__ = ("_backwards", "_by_folded", "_forwards", "names")

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(sorted(set(names)))
        self._by_folded = {name.casefold(): name for name in reversed(self.names)}
        self._forwards = sorted(self._by_folded)
        self._backwards = sorted(name[::-1] for name in self._by_folded)

    @lru_cache(maxsize=1024)  # noqa: B019 - vocabularies are cached themselves; typos repeat
    def close(self, name: str, count: int = 1) -> list[str]:
        """Return up to ``count`` names similar to ``name``, most similar first."""
        if len(name) > LONGEST_NAME:
            return []
        folded = name.casefold()
        alike = _most_similar(folded, self._candidates(folded), count)
        return [self._by_folded[match] for _, match in alike]

    def _candidates(self, folded: str) -> list[str]:
        number = _MAX_LETTERS // max(len(folded), 1)
        if len(self._forwards) <= min(_FEW, number):
            found: Iterable[str] = self._forwards
        else:
            side = max(1, min(_NEIGHBORS, number // 4))
            neighbors = _neighbors(folded, self._forwards, side)
            neighbors += (name[::-1] for name in _neighbors(folded[::-1], self._backwards, side))
            found = dict.fromkeys(neighbors)
        return [candidate for candidate in found if len(candidate) <= LONGEST_NAME]


@lru_cache(maxsize=16)
def vocabulary(names: tuple[str, ...]) -> Vocabulary:
    """Return the vocabulary of ``names``, cached."""
    return Vocabulary(names)


def misspelled(name: str, names: tuple[str, ...]) -> str | None:
    """Return the one of ``names`` that ``name`` differs from by a typo; None if there is none."""
    close = vocabulary(names).close(name, _MAX_MEANT)
    return next((other for other in close if is_typo(name, other)), None)


def _neighbors(name: str, ordered: Sequence[str], side: int) -> list[str]:
    place = bisect_left(ordered, name)
    return list(ordered[max(place - side, 0) : place + side])


def _most_similar(name: str, candidates: Iterable[str], count: int) -> list[tuple[float, str]]:
    """Return up to ``count`` names like ``name`` with their similarities, most similar first.

    The letters of a candidate limit its similarity, and are compared first: where that limit is
    below the similarities found so far, the order of its letters cannot matter.
    """
    matcher = SequenceMatcher(autojunk=False)
    matcher.set_seq2(name)
    likely: list[tuple[float, str]] = []
    for candidate in candidates:
        matcher.set_seq1(candidate)
        if matcher.real_quick_ratio() >= LEAST_LIKENESS:
            likely.append((matcher.quick_ratio(), candidate))
    letters, pairs = Counter(name), 0
    best: list[tuple[float, str]] = []
    for limit, candidate in sorted(likely, reverse=True):
        pairs += sum(map(letters.__getitem__, candidate))
        least = best[-1][0] if len(best) == count else LEAST_LIKENESS
        if limit < least or pairs > _MAX_PAIRS:
            break
        matcher.set_seq1(candidate)
        ratio = matcher.ratio()
        if ratio >= LEAST_LIKENESS:
            best = nlargest(count, [*best, (ratio, candidate)])
    return best
