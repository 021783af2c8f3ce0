"""What a command raises when it cannot do what it was asked to."""

from __future__ import annotations

FINDINGS = 1
USAGE = 2


class Failure(Exception):
    """An end that the person at the terminal can do something about.

    ``hint`` says what to do, in the imperative; ``exit_code`` is 1 or 2 (see the package).
    """

    def __init__(self, message: str, *, hint: str | None = None, exit_code: int = FINDINGS) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.exit_code = exit_code

    def text(self) -> str:
        """Return the lines for stderr, with nothing in them that could steer the terminal."""
        from composer.report.display import visible

        lines = [f"compose: {self.message}"]
        if self.hint is not None:
            lines.extend(f"  {line}" for line in self.hint.splitlines())
        return "\n".join(map(visible, lines))


class UsageFailure(Failure):
    """The command line itself is wrong."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(message, hint=hint, exit_code=USAGE)
