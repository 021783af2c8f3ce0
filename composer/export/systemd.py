"""A unit with which systemd runs a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from composer.model import System

#: ROS needs these; the others of a sourced workspace follow from its setup file.
ENVIRONMENT = (
    "AMENT_PREFIX_PATH",
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISTRO",
    "ROS_DOMAIN_ID",
    "ROS_STATIC_PEERS",
)
#: The wheels of ROS from PyPI set it when Python starts, and mark that.
_LIBRARIES, _OF_WHEELS = "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
#: Longer than --grace of compose run, by which the process ends in any case.
_STOP_TIMEOUT_S = 15

_UNIT = """\
# Written by 'compose export systemd' for the system {name}.
[Unit]
Description=ROS 2 system {name}{description}
Wants=network-online.target
After=network-online.target

[Service]
Type=exec
ExecStart={command}
WorkingDirectory={folder}
{environment}# compose run shuts the system down in order.
KillMode=mixed
KillSignal=SIGTERM
TimeoutStopSec={stop_s}
# Exit code 1: errors in files, or a node failed permanently. 2: a usage error, not retried.
Restart=on-failure
RestartSec=2
RestartPreventExitStatus=2

[Install]
WantedBy={target}
"""


def unit(
    system: System, path: Path, python: Sequence[str], environment: Mapping[str, str], *, user: bool
) -> str:
    """Return the unit of the system in ``path``.

    ``python`` is the command that starts compose. Of ``environment``, the variables that ROS reads
    become part of the unit. With ``user``, it is for the service manager of a user.
    """
    absolute = path.resolve()
    words = [*python, "run", str(absolute)]
    set_variables = [
        f"Environment={_quoted(f'{name}={environment[name]}')}\n"
        for name in ENVIRONMENT
        if environment.get(name) and not (name == _LIBRARIES and _OF_WHEELS in environment)
    ]
    description = system.description or ""
    return _UNIT.format(
        name=system.name.value,
        description=f": {_line(description)}" if description else "",
        command=" ".join(_quoted(word.replace("$", "$$")) for word in words),
        folder=_escaped(str(absolute.parent)),
        environment="".join(set_variables),
        stop_s=_STOP_TIMEOUT_S,
        target="default.target" if user else "multi-user.target",
    )


def _quoted(word: str) -> str:
    """Return a word for a command line or an assignment, as systemd reads it."""
    text = _escaped(word)
    if text and all(character.isalnum() or character in "/._-=:+,@" for character in text):
        return text
    inner = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{inner}"'


def _escaped(text: str) -> str:
    return text.replace("%", "%%")


def _line(text: str) -> str:
    return _escaped(" ".join(text.split()))
