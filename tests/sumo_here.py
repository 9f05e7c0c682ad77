"""A mark for tests that need Eclipse SUMO."""

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.programs.sumo_programs import find_sumo


def _is_installed():
    try:
        find_sumo()
    except SeipError:
        return False
    return True


needs_sumo = pytest.mark.skipif(not _is_installed(), reason="SUMO is not installed: make sumo")
