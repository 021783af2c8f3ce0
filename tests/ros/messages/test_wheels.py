"""Which message packages the wheels of ROS from PyPI contain."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, requires

from composer.interfaces.sources import Bundle
from composer.model.interface_packages import NOT_IN_WHEELS

_REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)\s*(\[(?P<extra>\w+)\])?")
_CONDITION = re.compile(r"extra == .(?P<extra>\w+)")


def installed(package: str, extra: str | None) -> set[tuple[str, str | None]]:
    """Return the packages that pip installs with a package and one of its extras."""
    found: set[tuple[str, str | None]] = set()
    left = [(package, extra)]
    while left:
        if (item := left.pop()) in found:
            continue
        found.add(item)
        try:
            texts = requires(item[0]) or ()
        except PackageNotFoundError:  # for another platform
            continue
        for text in texts:
            condition, required = _CONDITION.search(text), _REQUIREMENT.match(text)
            if required and (condition is None or condition["extra"] == item[1]):
                left.append((required["name"].replace("_", "-"), required["extra"]))
    return found


def test_packages_that_ros_on_pypi_lacks_are_known() -> None:
    names = {name.replace("-", "_") for name, _ in installed("ros2-composer", "ros")}
    found = {re.sub("^(ros_)?(jazzy_)?", "", name) for name in names}
    assert "sensor_msgs" in found
    assert Bundle().packages() - found == NOT_IN_WHEELS
