"""Limits Fast DDS to network interfaces, which only a profile can do."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence

from composer.model import Discovery
from composer.runtime.middleware.dds_profiles import is_own_profile, save_profile
from composer.runtime.process import StartRefused
from composer.runtime.process.addresses import has_interface, interface_names

_PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_TRANSPORTS_VARIABLE = "FASTDDS_BUILTIN_TRANSPORTS"
_RANGE_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_UNUSED = "'interfaces' of the system are not used"
#: With others, rmw_fastrtps replaces the transports of a profile.
_RANGES = ("", "SUBNET", "SYSTEM_DEFAULT")


def use_interfaces(discovery: Discovery | None, environment: MutableMapping[str, str]) -> list[str]:
    """Select a profile for the network interfaces of a system, if it has some.

    Return a warning if the environment prevents it. Raises StartRefused if there is no such
    interface: Fast DDS would discover nothing, and only log why.
    """
    interfaces = [] if discovery is None else [item.value for item in discovery.interfaces]
    if not interfaces:
        return []
    for text in interfaces:
        if not has_interface(text):
            raise StartRefused(
                f"this computer has no network interface '{text}' ('discovery' of the system)",
                f"it has {', '.join(interface_names())}; see 'ip address'",
            )
    if (
        not is_own_profile(environment)
        or environment.get(_TRANSPORTS_VARIABLE)
        or environment.get(_RANGE_VARIABLE, "") not in _RANGES
    ):
        return [
            f"{_UNUSED}: the environment sets a profile or transports of Fast DDS, or"
            f" {_RANGE_VARIABLE}"
        ]
    content = profile_for_interfaces(environment[_PROFILES_VARIABLE], interfaces)
    try:
        environment[_PROFILES_VARIABLE] = str(save_profile(content))
    except OSError as error:
        return [f"{_UNUSED}: cannot write the profile '{error.filename}': {error.strerror}"]
    return []


def profile_for_interfaces(path: str, interfaces: Sequence[str]) -> str:
    """Return the profile in the file ``path`` with these network interfaces only, as XML."""
    from composer.runtime.middleware.dds_xml import Profile, add, child  # noqa: PLC0415 - slow, rare

    profile = Profile(path)
    allowed = child(profile.udp, "interfaceWhiteList")
    for interface in interfaces:
        is_address = interface.replace(".", "").isdigit()
        add(allowed, "address" if is_address else "interface", interface)
    return profile.text()
