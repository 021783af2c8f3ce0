"""A terminal shown anew again and again, and left as it was; plain text where there is none."""

from __future__ import annotations

import select
import shutil
import sys
import termios
import tty
from contextlib import suppress
from typing import Any, Self

from composer.cli.support.terminal import write, write_raw

_ALTERNATE, _ORDINARY = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_KEYS_THAT_END = "qQ\x03\x04\x1b"


class Screen:
    """Use it in a ``with`` block. Where stdout is no terminal, what is drawn is printed below.

    The same where it is not ``wanted``: what is shown anew is gone in the end.
    """

    def __init__(self, *, wanted: bool = True) -> None:
        self._is_live = wanted and sys.stdout.isatty() and sys.stdin.isatty()
        self._before: list[Any] = []

    def __enter__(self) -> Self:
        if self._is_live:
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
            write_raw(_ALTERNATE)
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_live:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)
            write_raw(_ORDINARY)

    @property
    def lines(self) -> int | None:
        """How many lines there is room for; None where it does not matter."""
        return shutil.get_terminal_size().lines if self._is_live else None

    def draw(self, text: str) -> None:
        """Show ``text`` in place of what was there."""
        if not self._is_live:
            write(f"{text}\n" if "\n" in text else text)  # tables apart, lines together
            return
        width = shutil.get_terminal_size().columns
        shown = "\n".join(f"{line[:width]}{_CLEAR_LINE}" for line in text.splitlines())
        write_raw(f"{_HOME}{shown}{_CLEAR_BELOW}")

    def is_left(self) -> bool:
        """Tell whether a key was pressed that ends it: q, or Escape."""
        if not self._is_live:
            return False
        with suppress(OSError):
            if select.select([sys.stdin], [], [], 0.0)[0]:
                return sys.stdin.read(1) in _KEYS_THAT_END
        return False
