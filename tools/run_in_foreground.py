"""Run a command as the one that the terminal's keys speak to.

    python3 tools/run_in_foreground.py compose run systems/pipeline.yaml

Ctrl-C in a terminal reaches every process of the foreground group. Under make that is make as well,
which calls it an error and ends with 130, however orderly the command ended. So the command gets a
process group of its own and the terminal with it, as a shell does for its jobs; signals that arrive
here are passed on. Without a terminal there is nothing to arrange.
"""

import contextlib
import os
import signal
import sys

TERMINAL = 0
#: All but the first are passed on.
AWAITED = (signal.SIGCHLD, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _owns_terminal():
    try:
        return os.tcgetpgrp(TERMINAL) == os.getpgrp()
    except OSError:
        return False


def _give_terminal(group):
    with contextlib.suppress(OSError):  # it may have been closed meanwhile
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
    """Return the wait status of the child's end; stop and go on together with it (Ctrl-Z, fg)."""
    own_group = os.getpgrp()
    while True:
        number = signal.sigwait(AWAITED)
        if number != signal.SIGCHLD:
            os.kill(child, number)  # it is there until it was waited for
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
    # Whoever hands the terminal over from behind would be stopped by it.
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    # Blocked and waited for, none can come in the moment between a look and a sleep.
    signal.pthread_sigmask(signal.SIG_BLOCK, AWAITED)
    code = os.waitstatus_to_exitcode(_wait(_start(command)))
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
