"""A mark for tests that need Eclipse SUMO."""

from headless.sumo.simulation import find_sumo

import pytest

from seip_addon.core.errors import SeipError


def _is_installed():
    try:
        find_sumo()
    except SeipError:
        return False
    return True


needs_sumo = pytest.mark.skipif(not _is_installed(), reason="SUMO is not installed: make sumo")
