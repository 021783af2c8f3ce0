"""Interface packages in the sources of a project: whether they are built and up to date."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec

from composer.doctor.result import CheckResult, error, ok
from composer.interfaces import Interfaces
from composer.interfaces.building import how_to_build

AREA = "interfaces"
_KINDS = ("msg", "srv", "action")


def check_interfaces(
    packages: Iterable[str], sources: Interfaces, built: Interfaces
) -> Iterator[CheckResult]:
    """Check that ``packages`` are built from the current definitions.

    ``sources`` has the definitions of the project, ``built`` the installed ones.
    """
    found = sorted(packages)
    missing = [package for package in found if find_spec(package) is None]
    for package in missing:
        yield error(
            AREA,
            f"interface package '{package}' is not built: nodes that use it cannot start",
            how_to_build(package, sources.source_folder(package)),
        )
    stale = {
        package: names
        for package in found
        if package not in missing and (names := _changed(package, sources, built))
    }
    for package, names in stale.items():
        yield error(
            AREA,
            f"interface package '{package}' was built from different definitions of"
            f" {', '.join(names)}",
            f"{how_to_build(package, sources.source_folder(package))}, then restart all processes",
        )
    if found and not missing and not stale:
        yield ok(AREA, f"built: {', '.join(found)}")


def _changed(package: str, sources: Interfaces, built: Interfaces) -> list[str]:
    return [
        name
        for kind in _KINDS
        for name in sources.names(kind)
        if name.startswith(f"{package}/") and sources.find(name) != built.find(name)
    ]
