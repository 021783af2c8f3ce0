"""The entry point of ``compose``, the script and ``python -m composer``.

It begins without an import from a file: until Ctrl-C has its default action, it prints a traceback.
"""

# The part of signal that is built in.
import _signal as signal  # type: ignore[import-not-found]

_IS_INTERRUPTIBLE = signal.getsignal(signal.SIGINT) is signal.default_int_handler
if _IS_INTERRUPTIBLE:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import gc  # noqa: E402 - after the above
import sys  # noqa: E402 - after the above

if __name__ == "__main__" and not sys.flags.safe_path:
    # Python puts the current folder first, where a signal.py would replace the library's.
    del sys.path[0]


def run() -> int:
    """Run the command of this process and return its exit code."""
    from composer.cli import main  # noqa: PLC0415 - after the above

    # Searching for reference cycles takes a tenth of the time of `compose validate`, and finds none
    # while modules are imported and files are loaded. Commands that run long enable it again.
    gc.disable()
    code = main(is_interruptible=_IS_INTERRUPTIBLE)
    if "rclpy" not in sys.modules:
        # Python ends with a search. The objects of ROS are in reference cycles, and their
        # destructors have work to do.
        gc.freeze()
    return code


if __name__ == "__main__":
    sys.exit(run())
