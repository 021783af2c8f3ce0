"""A full-screen display that is redrawn; plain text where stdout is not a terminal."""

from __future__ import annotations

import select
import shutil
import sys
import termios
import tty
from contextlib import suppress
from typing import Any, Self

from composer.base.characters import escape_lines
from composer.cli.support.output.terminal import write, write_raw

_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_QUIT_KEYS = "qQ\x03\x04\x1b"


class Screen:
    """Use it in a ``with`` block; the terminal is restored at the end.

    Frames are printed one below the other if stdout is not a terminal or ``full`` is false.
    """

    def __init__(self, *, full: bool = True) -> None:
        self._is_full = full and sys.stdout.isatty() and sys.stdin.isatty()
        self._before: list[Any] = []

    def __enter__(self) -> Self:
        if self._is_full:
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
            write_raw(_ENTER)
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_full:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)
            write_raw(_LEAVE)

    @property
    def lines(self) -> int | None:
        """The height of the screen; None without a limit."""
        return shutil.get_terminal_size().lines if self._is_full else None

    def draw(self, text: str) -> None:
        """Show ``text`` in place of the last frame."""
        if not self._is_full:
            write(f"{text}\n" if "\n" in text else text)  # a blank line between tables
            return
        width = shutil.get_terminal_size().columns
        shown = "\n".join(f"{line[:width]}{_CLEAR_LINE}" for line in escape_lines(text).split("\n"))
        write_raw(f"{_HOME}{shown}{_CLEAR_BELOW}")

    def quit_requested(self) -> bool:
        """Say whether the user has pressed q, Escape or Ctrl-C."""
        if not self._is_full:
            return False
        with suppress(OSError):
            if select.select([sys.stdin], [], [], 0.0)[0]:
                return sys.stdin.read(1) in _QUIT_KEYS
        return False
