"""The command line: it parses arguments, calls the packages below and prints results.

stdout is data, stderr is everything else. Exit codes: 0 success, 1 errors in files or a failed
node, 2 usage error, 3 internal error, 78 errors in the files of a system to run.
"""

from __future__ import annotations

import errno
import gc
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from composer.characters import escape_line
from composer.cli.support.errors import FAILED, CommandError
from composer.cli.support.output.terminal import TolerantStream, drop

INTERNAL = 3
INTERRUPTED = 128 + signal.SIGINT

_DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def run() -> int:
    """Run the command of this process, as the script ``compose`` and ``python -m composer`` do."""
    # Searching for reference cycles takes a tenth of the time of `compose validate`, and finds none
    # while modules are imported and files are loaded. Commands that run long enable it again.
    gc.disable()
    code = main()
    if "rclpy" not in sys.modules:
        # Python ends with a search. The objects of ROS are in reference cycles, and their
        # destructors have work to do.
        gc.freeze()
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code.

    ``arguments`` defaults to those of the process. No exception is raised.
    """
    _open_missing_streams()
    stderr = sys.stderr
    sys.stderr = TolerantStream(stderr)
    try:
        from composer.cli.app import application

        given = sys.argv[1:] if arguments is None else list(arguments)
        application(given)(args=given, prog_name="compose")
    except KeyboardInterrupt:  # before or after typer handles it
        return INTERRUPTED
    except SystemExit as end:
        return _exit_code(end)
    except CommandError as failure:
        print(failure.text(), file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _os_error(error)
    except Exception as error:
        return INTERRUPTED if _is_caused_by_interrupt(error) else _internal_error(error)
    finally:
        _flush()
        sys.stderr = stderr
    return 0


def _open_missing_streams() -> None:
    """Open the null device in place of standard streams that are closed."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # open until the process ends
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def _os_error(error: OSError) -> int:
    """Report a full disk or a removed working directory; all else is an internal error."""
    if error.errno in _DISK_FULL:
        text = f"cannot write the output: {error.strerror}"
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


def _is_caused_by_interrupt(error: BaseException) -> bool:
    """Say whether Ctrl-C caused the error: C extensions raise ImportError for it while loading."""
    cause = error.__cause__
    return isinstance(cause, KeyboardInterrupt) or (
        cause is not None and _is_caused_by_interrupt(cause)
    )


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
