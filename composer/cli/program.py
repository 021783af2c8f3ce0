"""Runs one command, and turns every exception into an exit code."""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from composer.base.characters import escape_line
from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.terminal import TolerantStream, drop

INTERNAL = 3
INTERRUPTED = 128 + signal.SIGINT

#: After Ctrl-C, for the last output: what reads it may have stopped.
_FLUSHED_WITHIN_S = 1.0
_DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def run_command(arguments: Sequence[str] | None, *, is_interruptible: bool) -> int:
    """Run a command as :func:`composer.cli.main` does."""
    ended_by: BaseException | None = None
    _open_missing_streams()
    stderr = sys.stderr
    sys.stderr = TolerantStream(stderr)
    try:
        from composer.cli.app import application

        given = sys.argv[1:] if arguments is None else list(arguments)
        if is_interruptible:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        application(given)(args=given, prog_name="compose")
    except KeyboardInterrupt as interrupt:  # before or after typer handles it
        ended_by = interrupt
        return INTERRUPTED
    except SystemExit as end:
        ended_by = end
        return _exit_code(end)
    except CommandError as failure:
        print(failure.text(), file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _os_error(error)
    except Exception as error:
        return INTERRUPTED if _is_caused_by_interrupt(error) else _internal_error(error)
    finally:
        if is_interruptible and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            if _is_caused_by_interrupt(ended_by):
                signal.signal(signal.SIGALRM, lambda *_: os._exit(INTERRUPTED))
                signal.setitimer(signal.ITIMER_REAL, _FLUSHED_WITHIN_S)
        _flush()
        sys.stderr = stderr
    return 0


def _open_missing_streams() -> None:
    """Open the null device in place of standard streams that are closed."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # open until the process ends
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def _os_error(error: OSError) -> int:
    """Report a full disk, a private file or a removed directory; else an internal error."""
    if error.errno in _DISK_FULL:
        text = f"cannot write the output: {error.strerror}"
    elif isinstance(error, PermissionError) and error.filename is not None:
        text = escape_line(f"cannot use '{error.filename}': {error.strerror}")
    elif not _has_working_directory():
        text = "the current working directory does not exist anymore"
    else:
        return _internal_error(error)
    print(f"compose: {text}", file=sys.stderr)
    return FAILED


def _has_working_directory() -> bool:
    try:
        return bool(Path.cwd())
    except FileNotFoundError:
        return False


def _exit_code(end: SystemExit) -> int:
    if end.code is None:
        return 0
    return end.code if isinstance(end.code, int) else 1


def _is_caused_by_interrupt(error: BaseException | None) -> bool:
    """Say whether Ctrl-C caused the error: C extensions raise ImportError for it while loading."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _internal_error(error: Exception) -> int:
    """Report an internal error; with COMPOSE_DEBUG, print the traceback."""
    if os.environ.get("COMPOSE_DEBUG"):
        import traceback

        traceback.print_exception(error)
    text = escape_line(f"{type(error).__name__}: {error}")
    print(f"compose: internal error: {text}", file=sys.stderr)
    print(
        "  This is a bug in compose. Please report it with the output of the same command with\n"
        "  --debug (compose --debug ...) and of 'compose --version'.",
        file=sys.stderr,
    )
    return INTERNAL


def _flush() -> None:
    """Flush stdout now: at interpreter exit, a closed pipe would print a traceback."""
    try:
        sys.stdout.flush()
    except OSError:
        drop(sys.stdout)
