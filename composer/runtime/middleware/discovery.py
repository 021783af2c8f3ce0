"""Applies the ``discovery`` of a system to the environment variables of a process.

Child processes inherit them, and the tools of ROS use the same ones. What the user has set in the
environment takes precedence, as everywhere in ROS. See docs/decisions/0066-discovery.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping
from typing import TYPE_CHECKING

from composer.runtime.process.instance_lock import local_discovery

if TYPE_CHECKING:
    from composer.model import Discovery

#: These say where others are found.
_WHERE = ("ROS_DISCOVERY_SERVER", "ROS_STATIC_PEERS")
_VARIABLES = (*_WHERE, "ROS_SUPER_CLIENT", "ROS_AUTOMATIC_DISCOVERY_RANGE")


def use_discovery(discovery: Discovery | None, environment: MutableMapping[str, str]) -> None:
    """Set what the processes of a system need, unless the environment says something else.

    Call it after the profile has been selected.
    """
    if discovery is not None and discovery_conflict(discovery, environment) is None:
        _set_missing(discovery.variables, environment)


def discovery_conflict(discovery: Discovery, environment: Mapping[str, str]) -> str | None:
    """Return why the environment does not allow the discovery of a system; None if it does."""
    for name in _WHERE:
        given = environment.get(name)
        if given and given != discovery.variables.get(name):
            return f"'discovery' of the system is not used: {name} is set to '{given}'"
    return None


def active_variables(discovery: Discovery | None, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables of a system's discovery; none if the environment does not allow it."""
    if discovery is None or discovery_conflict(discovery, environment) is not None:
        return {}
    return discovery.variables


def adopt_discovery(environment: MutableMapping[str, str]) -> str | None:
    """Set what a command needs to discover the systems that run on this computer.

    What is set already takes precedence. Return a warning if the systems are discovered in
    different ways: a process can use one of them.
    """
    if any(map(environment.get, _WHERE)):
        return None
    found = {
        name: {key: value for key, value in variables.items() if key in _VARIABLES}
        for name, variables in local_discovery().items()
    }
    different = {tuple(variables.items()) for variables in found.values()}
    if len(different) > 1:
        listed = "; ".join(
            f"{name}: {as_assignments(variables) or 'multicast'}"
            for name, variables in sorted(found.items())
        )
        return (
            "the systems on this computer are discovered in different ways, and this command finds"
            f" those with multicast; export the variables of another one ({listed})"
        )
    for variables in different:
        _set_missing(dict(variables), environment)
    return None


def as_assignments(variables: Mapping[str, str]) -> str:
    """Return the variables as a shell takes them after ``export``."""
    return " ".join(_assignments(variables))


def _assignments(variables: Mapping[str, str]) -> Iterator[str]:
    for name, value in variables.items():
        yield f"{name}='{value}'" if ";" in value else f"{name}={value}"


def _set_missing(variables: Mapping[str, str], environment: MutableMapping[str, str]) -> None:
    for name, value in variables.items():
        if not environment.get(name):
            environment[name] = value
