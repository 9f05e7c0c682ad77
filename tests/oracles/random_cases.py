"""How many random cases of a property are tried: few in quick runs, all of them with the slow tests."""

from __future__ import annotations

from hypothesis import HealthCheck, settings


def cases(many: int, few: int = 8) -> settings:
    """Return settings for so many random cases where slow tests run as well, and for ``few`` in quick runs."""
    number = min(many, few) if settings.get_current_profile_name() == "quick" else many
    return settings(max_examples=number, deadline=None, suppress_health_check=list(HealthCheck))
