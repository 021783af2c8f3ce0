"""Names of nodes with wildcards, and which of them match a name.

The patterns form a tree by their parts, so that a name is compared with the patterns that begin
like it, and not with all of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field

from composer.fast_dataclass import dataclass

ONE_PART = "*"
ANY_PARTS = "**"


@dataclass(eq=False, slots=True)
class _Branch:
    """What follows a part of patterns. ``pattern`` ends here, if any."""

    is_any_parts: bool = False
    pattern: str | None = None
    following: dict[str, _Branch] = field(default_factory=dict)


class NamePatterns:
    """A set of patterns."""

    def __init__(self) -> None:
        self._root = _Branch()

    def add(self, pattern: str) -> None:
        """Add a canonical pattern."""
        branch = self._root
        for part in parts_of(pattern):
            branch = branch.following.setdefault(part, _Branch(is_any_parts=part == ANY_PARTS))
        branch.pattern = pattern

    def matching(self, name: str) -> list[str]:
        """Return the patterns that match the full name of a node."""
        branches = _with_no_parts([self._root])
        for part in parts_of(name):
            following = [branch for branch in branches if branch.is_any_parts]
            following += (
                branch.following[key]
                for branch in branches
                for key in (part, ONE_PART)
                if key in branch.following
            )
            branches = _with_no_parts(following)
        return [branch.pattern for branch in branches if branch.pattern is not None]


def is_pattern(name: str) -> bool:
    """Return whether a name has wildcards."""
    return "*" in name


def canonical(pattern: str) -> str:
    """Return an equal pattern in which no ``**`` follows another one."""
    parts = parts_of(pattern)
    kept = (
        part
        for part, previous in zip(parts, (None, *parts), strict=False)
        if (part, previous) != (ANY_PARTS, ANY_PARTS)
    )
    return f"/{'/'.join(kept)}"


def parts_of(name: str) -> tuple[str, ...]:
    """Return the parts of an absolute name or pattern."""
    return tuple(name.strip("/").split("/"))


def _with_no_parts(branches: Iterable[_Branch]) -> list[_Branch]:
    """Return the branches, and those after a ``**`` that stands for no part."""
    found = dict.fromkeys(branches)
    for branch in list(found):
        if ANY_PARTS in branch.following:
            found[branch.following[ANY_PARTS]] = None
    return list(found)
