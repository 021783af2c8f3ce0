"""Numbers that tell who sent them and when, and what is wrong with how they arrive."""

from __future__ import annotations

_PER_WRITER = 10**9


def number(writer: int, sequence: int) -> int:
    """Return the number that ``writer`` sends as its ``sequence``-th."""
    return writer * _PER_WRITER + sequence


class Sequences:
    """What one reader has seen of every writer. Each may begin anywhere and must go on by one."""

    def __init__(self) -> None:
        self.count = 0
        self.last: dict[int, int] = {}
        self.first: dict[int, int] = {}
        self.wrong: list[str] = []

    def take(self, received: int) -> None:
        """Look at a number that has come."""
        self.count += 1
        writer, sequence = divmod(received, _PER_WRITER)
        last = self.last.get(writer)
        if last is None:
            self.first[writer] = sequence
        elif sequence != last + 1:
            what = "gap" if sequence > last else "again" if sequence == last else "out of order"
            self.wrong.append(f"writer {writer}: {last}, {sequence}: {what}")
        self.last[writer] = sequence
