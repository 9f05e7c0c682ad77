"""Roles of objects in a scene: the collections of the scene contract.

`tests/scene/test_roles.py` shows its use.
"""

from enum import Enum


class Role(Enum):
    """Role of a part in the placement: its collection in the scene contract."""

    REGION = "region of interest"
    ROADS = "roads"
    GROUND = "ground"
    OCCLUDERS = "occluders"
    POLES = "poles"
    CANDIDATE_AREAS = "candidate areas"
    WEIGHTED_REGIONS = "weighted regions"
    FORBIDDEN_AREAS = "forbidden areas"
    MANDATORY_AREAS = "mandatory areas"
    DRESSING = "dressing"
    """Appearance only: no ray ends on these objects."""


AREA_OVERLAYS = {
    Role.REGION: (0.03, "region veil"),
    Role.WEIGHTED_REGIONS: (0.04, "weighted veil"),
    Role.FORBIDDEN_AREAS: (0.05, "forbidden veil"),
    Role.MANDATORY_AREAS: (0.06, "mandatory veil"),
    Role.CANDIDATE_AREAS: (0.03, "candidate veil"),
}
"""Height above the ground (metres) and material of overlays that mark areas."""
