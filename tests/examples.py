"""How many examples hypothesis generates: by default, in a hurry, and overnight.

``pytest --hypothesis-profile fast`` (``make test-fast``), ``--hypothesis-profile thorough``
(``make soak``).
"""

from __future__ import annotations

from hypothesis import HealthCheck, settings

DEFAULT = "tests"
_FACTORS = {DEFAULT: 0.5, "fast": 0.25, "thorough": 10.0}


def register_profiles() -> None:
    """Register the profiles and load the default one."""
    for name in _FACTORS:
        # The duration of an example depends on the load of the machine and on first imports.
        settings.register_profile(name, deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile(DEFAULT)


def examples(count: int) -> settings:
    """Return the settings for a test of which ``count`` examples, times a factor, are checked."""
    return settings(
        max_examples=round(count * _FACTORS.get(settings.get_current_profile_name(), 1.0))
    )
