"""The command line: it parses, calls and prints. Whatever decides lives below.

stdout is data, stderr is everything else. Exit codes: 0 clean, 1 findings or a node failed,
2 usage, 3 a fault of the composer itself.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from composer.cli.support.failure import FINDINGS, Failure

INTERNAL = 3
INTERRUPTED = 128 + signal.SIGINT

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that ``arguments`` (those of the process unless given) name.

    Returns the exit code; nothing is raised.
    """
    _have_streams()
    try:
        from composer.cli.app import application

        given = sys.argv[1:] if arguments is None else list(arguments)
        application(given)(args=given, prog_name="compose")
    except KeyboardInterrupt:  # so early, or so late, that typer does not see it
        return INTERRUPTED
    except SystemExit as end:
        return _exit_code(end)
    except Failure as failure:
        print(failure.text(), file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _machine_error(error)
    except Exception as error:
        return INTERRUPTED if _comes_of_an_interrupt(error) else _internal_error(error)
    finally:
        _flush()
    return 0


def _have_streams() -> None:
    """Let streams that the process was started without lead nowhere."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # opened for as long as the process lives
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def _machine_error(error: OSError) -> int:
    """Say what is wrong with the machine, where that is known, and not with us."""
    if error.errno in _NO_ROOM:
        text = f"the output cannot be written: {error.strerror}"
    elif not _is_in_a_folder():
        text = "the current folder is gone: somebody has removed it"
    else:
        return _internal_error(error)
    print(f"compose: {text}", file=sys.stderr)
    return FINDINGS


def _is_in_a_folder() -> bool:
    try:
        return bool(Path.cwd())
    except FileNotFoundError:
        return False


def _exit_code(end: SystemExit) -> int:
    if end.code is None:
        return 0
    return end.code if isinstance(end.code, int) else 1


def _comes_of_an_interrupt(error: BaseException) -> bool:
    """Say whether it was Ctrl-C: a module in C makes another error of it while it is loaded."""
    cause = error.__cause__
    return isinstance(cause, KeyboardInterrupt) or (
        cause is not None and _comes_of_an_interrupt(cause)
    )


def _internal_error(error: Exception) -> int:
    """Say shortly that this is our fault; the traceback is for who asks for it."""
    if os.environ.get("COMPOSE_DEBUG"):
        import traceback

        traceback.print_exception(error)
    print(f"compose: internal error: {type(error).__name__}: {error}", file=sys.stderr)
    print(
        "  This is a fault of compose, not of your files. Please report it with the output of\n"
        "  the same command with --debug in front (compose --debug ...) and of compose --version.",
        file=sys.stderr,
    )
    return INTERNAL


def _flush() -> None:
    """Write out what is buffered now: at interpreter exit a closed pipe would be a traceback."""
    from composer.cli.support.terminal import drop_stdout

    try:
        sys.stdout.flush()
    except OSError:
        drop_stdout()
