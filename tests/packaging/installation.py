"""An environment with the composer in it, as its user has it."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

# Set by this process' own Python when that has the ros wheels, and only right for that one.
OF_THIS_PYTHON = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
OF_A_ROS = ("AMENT_PREFIX_PATH", "PYTHONPATH")


def without_ros() -> dict[str, str]:
    """Return this process' environment variables as they are where there is no ROS."""
    hidden = (*OF_THIS_PYTHON, *OF_A_ROS)
    return {name: value for name, value in os.environ.items() if name not in hidden}


def with_this_ros() -> dict[str, str]:
    """Return environment variables that give another Python the ROS of this one, as sourcing
    does."""
    sites = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    return dict(os.environ) | {"PYTHONPATH": os.pathsep.join(sites)}


@dataclass(frozen=True, slots=True)
class Installation:
    """A virtual environment with the wheel installed, and a folder that is not the project's."""

    environment: Path
    elsewhere: Path

    @property
    def package(self) -> Path:
        """Where the package was installed."""
        (package,) = self.environment.glob("lib/python*/site-packages/composer")
        return package

    def run(
        self, *command: str | Path, variables: dict[str, str], timeout_s: float = 60
    ) -> subprocess.CompletedProcess[str]:
        """Run a command of the environment in the other folder."""
        program, *arguments = map(str, command)
        return subprocess.run(
            [str(self.environment / "bin" / program), *arguments],
            cwd=self.elsewhere,
            env=variables,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
