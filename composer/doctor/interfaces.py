"""Interface packages among a project's sources: whether they are built, and as they are now."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec

from composer.doctor.finding import Finding, error, fine
from composer.interfaces import Interfaces

AREA = "interfaces"
_KINDS = ("msg", "srv", "action")


def how_to_build(package: str) -> str:
    """Return what makes an interface package known to Python."""
    by_colcon = f"colcon build --packages-select {package}, then source install/setup.bash"
    ours = package == "composer_interfaces"  # a folder of the composer, which pip can build
    return f"pip install ./interfaces   or: {by_colcon}" if ours else by_colcon


def look_at_interfaces(
    packages: Iterable[str], sources: Interfaces, built: Interfaces
) -> Iterator[Finding]:
    """Yield which ``packages`` are not built, and which types were built from other sources.

    ``sources`` are the definitions that count for checks, ``built`` those that are installed.
    """
    found = sorted(packages)
    missing = [package for package in found if find_spec(package) is None]
    for package in missing:
        yield error(
            AREA,
            f"interface package '{package}' is not built: nodes that use it do not start",
            how_to_build(package),
        )
    stale = {
        package: names
        for package in found
        if package not in missing and (names := _changed(package, sources, built))
    }
    for package, names in stale.items():
        yield error(
            AREA,
            f"interface package '{package}' was built from other definitions of {', '.join(names)}",
            f"colcon build --packages-select {package}, then start every process anew",
        )
    if found and not missing and not stale:
        yield fine(AREA, f"built: {', '.join(found)}")


def _changed(package: str, sources: Interfaces, built: Interfaces) -> list[str]:
    return [
        name
        for kind in _KINDS
        for name in sources.names(kind)
        if name.startswith(f"{package}/") and sources.find(name) != built.find(name)
    ]
