"""Run a command as the foreground process group of the terminal.

    python3 tools/run_in_foreground.py compose run systems/pipeline.yaml

Ctrl-C sends SIGINT to all processes of the foreground group, including make, which then exits with
an error even if the command shuts down cleanly. The command therefore runs in a separate process
group, which becomes the foreground group, as in a shell. Signals that this script receives are
forwarded. Without a terminal, the command is executed directly.
"""

import contextlib
import os
import signal
import sys

TERMINAL = 0
#: All except SIGCHLD are forwarded.
AWAITED = (signal.SIGCHLD, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _owns_terminal():
    try:
        return os.tcgetpgrp(TERMINAL) == os.getpgrp()
    except OSError:
        return False


def _give_terminal(group):
    with contextlib.suppress(OSError):  # the terminal may be closed
        os.tcsetpgrp(TERMINAL, group)


def _start(command):
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        _give_terminal(os.getpgrp())
        signal.signal(signal.SIGTTOU, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, AWAITED)
        os.execvp(command[0], command)
    return child


def _wait(child):
    """Return the wait status of the child; stop and continue together with it (Ctrl-Z, fg)."""
    own_group = os.getpgrp()
    while True:
        number = signal.sigwait(AWAITED)
        if number != signal.SIGCHLD:
            os.kill(child, number)  # the process ID is valid until waitpid
            continue
        ended_or_stopped, status = os.waitpid(child, os.WUNTRACED | os.WNOHANG)
        if not ended_or_stopped:
            continue
        _give_terminal(own_group)
        if not os.WIFSTOPPED(status):
            return status
        os.killpg(own_group, signal.SIGSTOP)
        if _owns_terminal():
            _give_terminal(child)
        os.killpg(child, signal.SIGCONT)


def main(command):
    """Run the command and return its exit code as a shell would."""
    if not _owns_terminal():
        os.execvp(command[0], command)
    # tcsetpgrp() from a background group would otherwise stop this process.
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    # Blocked signals are received by sigwait(), without a race.
    signal.pthread_sigmask(signal.SIG_BLOCK, AWAITED)
    code = os.waitstatus_to_exitcode(_wait(_start(command)))
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
