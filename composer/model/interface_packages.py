"""Which interface packages a system uses, and how to build one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from composer.base.source import shown_path
from composer.interfaces.sources import Bundle

if TYPE_CHECKING:
    from composer.model import Node, System

#: The services of component containers.
COMPOSITION = "composition_interfaces"
#: Packages of the bundled definitions that are not among the wheels of ROS from PyPI.
NOT_IN_WHEELS = frozenset(
    (
        "composer_interfaces",
        COMPOSITION,
        "control_msgs",
        "example_interfaces",
        "geographic_msgs",
        "nav2_msgs",
        "tf2_msgs",
        "vision_msgs",
    )
)
#: Where PyPI has another name for a module that robots often import: another package, or none, has
#: the name of the module.
_DISTRIBUTIONS = {
    "can": "python-can",
    "cv2": "opencv-python",
    "PIL": "pillow",
    "RPi": "RPi.GPIO",
    "serial": "pyserial",
    "sklearn": "scikit-learn",
    "usb": "pyusb",
    "yaml": "pyyaml",
    "zmq": "pyzmq",
}


def used_packages(system: System) -> dict[str, Node]:
    """Return the interface packages that a system needs, with the first node that uses each."""
    users: dict[str, Node] = {}
    for node in system.nodes:
        for port in node.all_ports if node.implementation.in_process else node.ports:
            users.setdefault(port.interface.value.partition("/")[0], node)
        if node.component is not None and node.external is None:
            users.setdefault(COMPOSITION, node)
    return users


def _debian_name(package: str) -> str:
    return f"ros-jazzy-{package.replace('_', '-')}"


def how_to_build(package: str, folder: Path | None) -> str:
    """Return the command that builds and installs ``package``; ``folder`` has its source, if known.

    A package with a pyproject.toml can be built by pip, without colcon. Without a source, packages
    of ROS are built from the definitions that come with the composer.
    """
    by_colcon = f"colcon build --packages-select {package}, then source install/setup.bash"
    if folder is None:
        if package not in Bundle().packages():
            return by_colcon
        return f"compose interface build {package}   or: apt install {_debian_name(package)}"
    if not (folder / "pyproject.toml").is_file():
        return f"compose interface build {package}   or: {by_colcon}"
    return f"pip install {shown_path(folder)}   or: {by_colcon}"


def how_to_get(module: str) -> str:
    """Return how to install the package of a Python module that an import has not found."""
    package = module.partition(".")[0]
    if package in Bundle().packages():
        return how_to_build(package, None)
    if package in _DISTRIBUTIONS:
        return f"pip install {_DISTRIBUTIONS[package]}"
    by_apt = f"apt install {_debian_name(package)}, or build it in a workspace"
    return f"pip install {package}   or, if it is a package of ROS: {by_apt}"
