"""What the help pages of all commands have in common."""

from __future__ import annotations


def examples(*lines: str) -> str:
    """Return the end of a help page: commands to copy, one a line, exactly as written."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)
