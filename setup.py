"""Lets colcon build the composer as an ament_python package. pip uses pyproject.toml alone."""

from __future__ import annotations

import tomllib
from pathlib import Path

from setuptools import Distribution, find_packages, setup

PACKAGE = "ros2_composer"
#: Where colcon links to this file, there is no pyproject.toml.
ROOT = Path(__file__).resolve().parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
#: Folders that are part of the installed package, as in a wheel. With --symlink-install, colcon
#: builds in a folder that has links to the sources only, and they are not needed.
SHARED = {
    f"composer.share.{Path(folder).name}": folder
    for folder in ("docs/rules", "interfaces", "nodes", "schemas", "systems")
    if Path(folder).is_dir()
}
INDEX = "share/ament_index/resource_index"


class WithoutPyproject(Distribution):
    """Does not read pyproject.toml, whose metadata is too new for setuptools of Ubuntu 24.04."""

    def parse_config_files(
        self, filenames: list[str] | None = None, ignore_option_errors: bool = False
    ) -> None:
        """Read only the named files."""
        super().parse_config_files(filenames or [], ignore_option_errors)


setup(
    distclass=WithoutPyproject,
    name=PROJECT["name"],
    version=PROJECT["version"],
    description=PROJECT["description"],
    license=PROJECT["license"],
    python_requires=PROJECT["requires-python"],
    install_requires=[item.partition(";")[0] for item in PROJECT["dependencies"]],
    packages=[
        *find_packages(include=["composer", "composer.*"]),
        *SHARED,
    ],
    package_dir=SHARED,
    package_data={"": ["*", "**/*"]},
    exclude_package_data={"": ["__pycache__/*", "**/__pycache__/*"]},
    data_files=[
        (f"{INDEX}/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    entry_points={
        group: [f"{name} = {target}" for name, target in scripts.items()]
        for group, scripts in {
            "console_scripts": PROJECT["scripts"],
            **PROJECT["entry-points"],
        }.items()
    },
    zip_safe=False,
)
