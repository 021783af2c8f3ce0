"""The shell commands that run on a host."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from composer.model import Host
from composer.runtime.middleware.environment import CONSOLE_FORMAT

#: Exit codes of the commands: what kept them from starting Python.
NO_WORKSPACE, NO_SETUP, NO_PYTHON = 71, 72, 73
#: The variables of ROS that are set on the hosts as they are here.
_PASSED_ON = (
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DOMAIN_ID",
    "ROS_STATIC_PEERS",
)
_IN_WORKSPACE = ".venv/bin/python"
GUARD = "composer.client.hosts.guard"


def python_command(
    host: Host, words: Sequence[str], environment: Mapping[str, str], silence_s: float | None = None
) -> str:
    """Return :func:`python_words` as the command line that ssh sends."""
    return f"exec {shlex.join(python_words(host, words, environment, silence_s))}"


def python_words(
    host: Host, words: Sequence[str], environment: Mapping[str, str], silence_s: float | None = None
) -> list[str]:
    """Return the command that runs Python with ``words`` in the workspace of a host, by a shell.

    ``environment`` are variables of this process: those of ROS are passed on. With ``silence_s``,
    it runs under a guard (:mod:`composer.client.hosts.guard`).
    """
    passed = {name: environment[name] for name in _PASSED_ON if environment.get(name)}
    passed |= {"PYTHONUNBUFFERED": "1", "RCUTILS_CONSOLE_OUTPUT_FORMAT": CONSOLE_FORMAT}
    passed |= {name.value: value for name, value in host.environment}
    lines = [f"cd {quoted_path(workspace(host))} || exit {NO_WORKSPACE}"]
    lines += [_source(quoted_path(script)) for script in host.setup]
    lines += [f"export {shlex.quote(f'{name}={value}')}" for name, value in passed.items()]
    guard = "" if silence_s is None else f'"$python" -P -m {GUARD} {silence_s:g} '
    lines += [_python(host), f'exec {guard}"$python" -P {shlex.join(words)}']
    shell = "bash" if any(script.endswith(".bash") for script in host.setup) else "sh"
    return [shell, "-c", "; ".join(lines)]


def workspace(host: Host) -> str:
    """Return the folder of the project there."""
    if host.workspace is None:
        raise AssertionError(f"host {host.name} has no workspace")
    return host.workspace.value


def quoted_path(path: str) -> str:
    """Return a path for a shell: ``~/`` is the home folder, everything else is taken literally."""
    if path.startswith("~/"):
        return f'"$HOME"/{shlex.quote(path[2:])}'
    return shlex.quote(path)


def _source(script: str) -> str:
    """Return the command that sources a script. A shell searches PATH for names without slash."""
    path = script if script.startswith(("/", "'/", '"$HOME"/')) else f"./{script}"
    return f"[ -r {path} ] || exit {NO_SETUP}; . {path}"


def _python(host: Host) -> str:
    if host.python is not None:
        found = f"python={quoted_path(host.python)}"
    else:
        found = f"python={_IN_WORKSPACE}; [ -x $python ] || python=python3"
    return f'{found}; command -v "$python" >/dev/null || exit {NO_PYTHON}'
