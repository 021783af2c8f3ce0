"""The command line: it parses arguments, calls the packages below and prints results.

stdout is data, stderr is everything else. Exit codes: 0 success, 1 errors in files or a failed
node, 2 usage error, 3 internal error, 78 errors in the files of a system to run.
"""

from __future__ import annotations

from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None, *, is_interruptible: bool = False) -> int:
    """Run a command and return the exit code. No exception is raised.

    ``arguments`` defaults to the arguments of the process. With ``is_interruptible``, Ctrl-C
    interrupts the command; before and after, it ends the process.
    """
    from composer.cli.program import run_command

    return run_command(arguments, is_interruptible=is_interruptible)
