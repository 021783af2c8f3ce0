"""The command line: it parses arguments, calls the packages below and prints results.

stdout is data, stderr is everything else. Exit codes: 0 success, 1 errors in files or a failed
node, 2 usage error, 3 internal error, 78 errors in the files of a system to run.
"""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Sequence


def run() -> int:
    """Run the command of this process, as the script ``compose`` and ``python -m composer`` do."""
    # Outside of main, Ctrl-C would print a traceback.
    is_interruptible = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_interruptible:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # Searching for reference cycles takes a tenth of the time of `compose validate`, and finds none
    # while modules are imported and files are loaded. Commands that run long enable it again.
    gc.disable()
    code = main(is_interruptible=is_interruptible)
    if "rclpy" not in sys.modules:
        # Python ends with a search. The objects of ROS are in reference cycles, and their
        # destructors have work to do.
        gc.freeze()
    return code


def main(arguments: Sequence[str] | None = None, *, is_interruptible: bool = False) -> int:
    """Run a command and return the exit code. No exception is raised.

    ``arguments`` defaults to those of the process. With ``is_interruptible``, Ctrl-C interrupts
    the command; before and after, it ends the process.
    """
    from composer.cli.program import run_command

    return run_command(arguments, is_interruptible=is_interruptible)
