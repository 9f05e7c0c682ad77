"""Properties of a scene: all that the add-on keeps in the file."""

from __future__ import annotations

import bpy
from bpy.props import CollectionProperty, IntProperty, PointerProperty

from ..scene_status import FILE_VERSION
from .detection import SEIP_PG_detection
from .placement import SEIP_PG_goal
from .results import SEIP_PG_placement, SEIP_PG_result
from .simulation import SEIP_PG_simulation
from .site import SEIP_PG_site
from .survey import SEIP_PG_survey
from .traffic import SEIP_PG_traffic
from .verification import SEIP_PG_verification
from .view import SEIP_PG_view


class SEIP_PG_scene(bpy.types.PropertyGroup):
    """All that SEIP keeps with a scene."""

    version: IntProperty(name="Version", default=FILE_VERSION, options={"HIDDEN"})
    site: PointerProperty(type=SEIP_PG_site)
    survey: PointerProperty(type=SEIP_PG_survey)
    goal: PointerProperty(type=SEIP_PG_goal)
    result: PointerProperty(type=SEIP_PG_result)
    kept: CollectionProperty(type=SEIP_PG_placement)
    active_kept: IntProperty(name="Kept Placement", description="Placement to compare the present one with")
    view: PointerProperty(type=SEIP_PG_view)
    traffic: PointerProperty(type=SEIP_PG_traffic)
    simulation: PointerProperty(type=SEIP_PG_simulation)
    detection: PointerProperty(type=SEIP_PG_detection)
    verification: PointerProperty(type=SEIP_PG_verification)


CLASSES = (SEIP_PG_scene,)


def attach() -> None:
    """Give every scene its properties."""
    bpy.types.Scene.seip = PointerProperty(type=SEIP_PG_scene)


def detach() -> None:
    """Take them away."""
    del bpy.types.Scene.seip
