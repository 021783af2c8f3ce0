"""Numbers that encode their writer and sequence, and errors in their order."""

from __future__ import annotations

_PER_WRITER = 10**9


def number(writer: int, sequence: int) -> int:
    """Return the number that ``writer`` sends as its ``sequence``-th."""
    return writer * _PER_WRITER + sequence


class Sequences:
    """What one reader has received of each writer, starting anywhere, counting by one."""

    def __init__(self) -> None:
        self.count = 0
        self.last: dict[int, int] = {}
        self.missing: dict[int, int] = {}
        self.disordered: list[str] = []

    def take(self, received: int) -> None:
        """Check a number that was received."""
        self.count += 1
        writer, sequence = divmod(received, _PER_WRITER)
        last = self.last.get(writer, sequence - 1)
        if sequence > last + 1:
            self.missing[writer] = self.missing.get(writer, 0) + sequence - last - 1
        elif sequence <= last:
            what = "again" if sequence == last else "out of order"
            self.disordered.append(f"writer {writer}: {last}, {sequence}: {what}")
        self.last[writer] = sequence

    @property
    def wrong(self) -> list[str]:
        """Messages that are missing, duplicated or out of order."""
        gaps = [f"writer {writer}: {count} missing" for writer, count in self.missing.items()]
        return gaps + self.disordered
