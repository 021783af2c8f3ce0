"""Errors that end a command with a message and an exit code."""

from __future__ import annotations

from importlib.util import find_spec

#: Exit codes; 0 is success and 3 an internal error.
FAILED = 1
USAGE = 2
#: For ``compose run``: its files have to change first, so that service managers do not try again.
#: The number is EX_CONFIG of sysexits.h, by which systemd names it.
CONFIG = 78


class CommandError(Exception):
    """An error that the user can fix.

    ``hint`` says how, in the imperative; ``exit_code`` is FAILED, USAGE or CONFIG.
    """

    def __init__(self, message: str, *, hint: str | None = None, exit_code: int = FAILED) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.exit_code = exit_code

    def text(self) -> str:
        """Return the lines for stderr, without control characters."""
        from composer.base.characters import visible

        lines = [f"compose: {self.message}"]
        if self.hint is not None:
            lines.extend(f"  {line}" for line in self.hint.splitlines())
        return "\n".join(map(visible, lines))


class UsageError(CommandError):
    """The command line itself is wrong."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(message, hint=hint, exit_code=USAGE)


def require_extra(command: str, extra: str, *packages: str) -> None:
    """Raise CommandError if packages of an extra of ros2-composer are not installed."""
    missing = [name for name in packages if find_spec(name) is None]
    if missing:
        raise CommandError(
            f"'{command}' needs {', '.join(missing)}, which this Python does not have",
            hint=f'pip install "ros2-composer[{extra}]"',
        )
