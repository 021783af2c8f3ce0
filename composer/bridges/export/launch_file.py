"""A launch file that runs a system."""

from __future__ import annotations

import os
from pathlib import Path

from composer.model import System

_TEXT = '''\
"""Run the system {name} of ros2-composer. Written by 'compose export launch'."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration

from composer.launch.actions import ComposeSystem

SYSTEM = {system}


def generate_launch_description():
    """Return the system; the launch ends with it."""
    return LaunchDescription([
        DeclareLaunchArgument(
            "namespace", default_value="", description="Namespace of the system."
        ),
        DeclareLaunchArgument(
            "use_sim_time", default_value="false", description="Whether to use /clock."
        ),
        DeclareLaunchArgument(
            "log_level", default_value="info", description="Minimum severity of log messages."
        ),
        ComposeSystem(
            system=str(SYSTEM),
            namespace=LaunchConfiguration("namespace"),
            use_sim_time=LaunchConfiguration("use_sim_time"),
            log_level=LaunchConfiguration("log_level"),
            on_exit=Shutdown(reason="the system {name} has ended"),
        ),
    ])
'''


def launch_file(system: System, path: Path, output: Path | None) -> str:
    """Return the launch file of a system in ``path``.

    If the launch file is written to ``output``, it names the system relative to itself.
    """
    absolute = path.resolve()
    if output is None:
        place = f"Path({str(absolute)!r})"
    else:
        relative = os.path.relpath(absolute, output.resolve().parent)
        place = f"(Path(__file__).parent / {relative!r}).resolve()"
    return _TEXT.format(name=system.name.value, system=place)
