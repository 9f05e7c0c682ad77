"""Roles of objects in the placement, and weights of regions."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty

from ..core.site.roles import Role
from ..core.site.scene_geometry import DEFAULT_WEIGHT
from ..scene import contract, roles
from . import scene_status
from .layout import draw_reason, draw_sentence, settings_column
from .properties import as_typed
from .work import Conditional, Obstacles, ShortWork, select_alone

ROLE_ITEMS = tuple((role.name, role.value.capitalize(), f"{roles.WORDS[role].capitalize()}") for role in roles.ROLES)
AREA_ITEMS = tuple(item for item in ROLE_ITEMS if Role[item[0]] in roles.AREAS)


def _region_weight(obj: bpy.types.Object) -> float:
    value = obj.get(contract.WEIGHT, DEFAULT_WEIGHT)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else DEFAULT_WEIGHT  # the check says what is wrong with it


def _set_region_weight(obj: bpy.types.Object, value: float) -> None:
    obj[contract.WEIGHT] = as_typed(value)


PROPERTIES = (
    (
        bpy.types.Object,
        "seip_region_weight",
        FloatProperty(
            name="Weight",
            description=f"Weight of each target in this region; other targets have 1 ({contract.WEIGHT})",
            get=_region_weight,
            set=_set_region_weight,
            min=0.001,
            soft_max=10.0,
            options=set(),
        ),
    ),
)
"""Property of objects that edits a custom property of the contract."""


class WritesScene(Conditional):
    """A mixin for operators that write into the scene, which must belong to the open file."""

    obstacles: Obstacles = (scene_status.not_own,)


class InObjectMode(WritesScene):
    """A mixin for operators that cannot be used in Edit Mode."""

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return a reason in another mode than Object Mode."""
        return super().why_not(context) or ("" if context.mode == "OBJECT" else "Leave Edit Mode first")


class SEIP_OT_assign_role(WritesScene, ShortWork, bpy.types.Operator):
    """Link the selected objects to the collection of a role, or remove them from it; other collections stay"""

    bl_label = "Assign"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(name="Role", description="Role of the objects in the placement", items=ROLE_ITEMS)
    remove: bpy.props.BoolProperty(name="Remove", description="Take the objects out of the role", default=False)

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return a reason if nothing is selected or the scene is linked from another file."""
        return super().why_not(context) or ("" if context.selected_objects else "Select objects first")

    def act(self, context: bpy.types.Context) -> None:
        """Link or unlink them."""
        role = Role[self.role]
        change, what = (roles.take_out, "taken out of") if self.remove else (roles.assign, "assigned to")
        self.report({"INFO"}, f"{change(context.scene, context.selected_objects, role)} {what} the {role.value}")


class SEIP_OT_add_area(InObjectMode, ShortWork, bpy.types.Operator):
    """Add a flat area in a role at the 3D cursor; go into Edit Mode to shape it"""

    bl_label = "Draw Area"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(name="Role", description="Role of the area in the placement", items=AREA_ITEMS)
    size: bpy.props.FloatVectorProperty(
        name="Size",
        description="Lengths along x and y",
        size=2,
        unit="LENGTH",
        default=(40.0, 40.0),
        min=0.1,
        soft_max=500.0,
    )

    def act(self, context: bpy.types.Context) -> None:
        """Add it, selected and active."""
        middle = tuple(context.scene.cursor.location)
        obj = roles.add_area(context.scene, Role[self.role], middle, tuple(self.size))
        select_alone(context, obj)


def draw_roles(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the buttons that change roles, then what the active object is: nothing above it moves."""
    site = context.scene.seip.site
    layout.prop(site, "role", text="")
    row = layout.row(align=True)
    row.operator("seip.assign_role", icon="ADD").role = site.role
    button = row.operator("seip.assign_role", text="Remove", icon="REMOVE")
    button.role, button.remove = site.role, True
    if Role[site.role] in roles.AREAS:
        layout.operator("seip.add_area").role = site.role
    if not draw_reason(layout, "" if context.object else "Select objects to give them a role."):
        _draw_object(layout, context.scene, context.object)


def _draw_object(layout: bpy.types.UILayout, scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    assigned = roles.roles_of(scene, obj)
    what = ", ".join(role.value for role in assigned) or "no role"
    draw_sentence(layout, f"{obj.name}: {what}", icon="OBJECT_DATA")
    column = settings_column(layout)
    column.enabled = obj.is_editable
    if Role.WEIGHTED_REGIONS in assigned:
        column.prop(obj, "seip_region_weight")
