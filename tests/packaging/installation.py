"""A virtual environment in which the composer is installed."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS: list[dict[str, Any]] = ACTION["runs"]["steps"]
#: The command with which GitHub starts the shell 'bash' of a step.
BASH = ("bash", "--noprofile", "--norc", "-eo", "pipefail", "-c")
# Set by the ros wheels of this Python, and valid for this Python only.
WHEEL_VARIABLES = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
ROS_VARIABLES = ("AMENT_PREFIX_PATH", "PYTHONPATH")
#: The packages of this Python, as a value of PYTHONPATH.
SITES = os.pathsep.join(
    path for path in sys.path if path.endswith(("site-packages", "dist-packages"))
)


def without_ros() -> dict[str, str]:
    """Return the environment variables of this process without those of ROS.

    With them, pip compiles nothing: of what it installs, the tests import little.
    """
    hidden = (*WHEEL_VARIABLES, *ROS_VARIABLES)
    kept = {name: value for name, value in os.environ.items() if name not in hidden}
    return kept | {"PIP_NO_COMPILE": "1"}


def with_this_ros() -> dict[str, str]:
    """Return environment variables with which another Python uses the ROS of this one."""
    return dict(os.environ) | {"PYTHONPATH": SITES}


def run_step(name: str, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a step of the GitHub action in ``folder``, as on a runner."""
    (step,) = [step for step in STEPS if step.get("name") == name]
    given = {key: variables.get(key, "") for key in step["env"]}
    return subprocess.run(
        [*BASH, step["run"]],
        cwd=folder,
        env=without_ros() | {"GITHUB_ACTIONS": "true"} | variables | given,
        capture_output=True,
        text=True,
        check=False,
    )


@dataclass(frozen=True, slots=True)
class Installation:
    """A virtual environment with the wheel, and a working directory outside the project."""

    environment: Path
    elsewhere: Path

    @property
    def package(self) -> Path:
        """The folder of the installed package."""
        (package,) = self.environment.glob("lib/python*/site-packages/composer")
        return package

    def validate(
        self, folder: Path, paths: str, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        """Run the step of the GitHub action that validates files."""
        temporary = str(self.environment.parent)
        return run_step("Validate", folder, RUNNER_TEMP=temporary, PATHS=paths, **variables)

    def run(
        self, *command: str | Path, variables: dict[str, str], timeout_s: float = 60
    ) -> subprocess.CompletedProcess[str]:
        """Run a command of the environment in the working directory."""
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
