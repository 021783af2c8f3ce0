"""Short labels for diagrams."""

from __future__ import annotations

from composer.qos import PRESETS, History, QosProfile
from composer.tree import Plain


def short_type(interface: str) -> str:
    """Return ``Odometry`` for ``nav_msgs/msg/Odometry``."""
    return interface.rpartition("/")[2] or interface


def rate(hertz: float) -> str:
    """Return a rate such as ``10 Hz``, with three significant digits."""
    return f"{float(f'{hertz:.3g}'):g} Hz"


def qos_label(profile: QosProfile) -> str:
    """Return the name of a matching preset, else the policies of the profile."""
    for name in ("command", "sensor_data", "state"):
        if profile == PRESETS[name]:
            return name
    return ", ".join([profile.reliability, profile.durability, _history(profile), *_times(profile)])


def discovered_qos_label(profile: QosProfile) -> str:
    """Return the policies that discovery reports, which exclude history and depth."""
    return ", ".join([profile.reliability, profile.durability, *_times(profile)])


def qos_facts(profile: QosProfile) -> dict[str, Plain]:
    """Return all policies that are set, with the keys of YAML."""
    facts: dict[str, Plain] = {
        "reliability": profile.reliability.value,
        "durability": profile.durability.value,
        "history": profile.history.value,
    }
    if profile.history is History.KEEP_LAST:
        facts["depth"] = profile.depth
    facts["liveliness"] = profile.liveliness.value
    for name in ("deadline_ms", "lifespan_ms", "liveliness_lease_duration_ms"):
        value = getattr(profile, name)
        if value is not None:
            facts[name] = value
    return facts


def _history(profile: QosProfile) -> str:
    if profile.history is History.KEEP_ALL:
        return "keep_all"
    return f"keep_last {profile.depth}"


def _times(profile: QosProfile) -> list[str]:
    times = {
        "deadline": profile.deadline_ms,
        "lifespan": profile.lifespan_ms,
        "lease": profile.liveliness_lease_duration_ms,
    }
    return [f"{name} {value:g} ms" for name, value in times.items() if value is not None]
