"""Comparison of the present placement with those that were kept."""

from __future__ import annotations

from itertools import count

import bpy

from ..core.base.errors import SeipError
from ..core.choosing.placement.returns_summary import returns_text
from ..core.output.pictures.colours import compare, unpacked_counts
from ..core.output.results.placement_record import PlacementRecord, parsed_record
from ..scene.coverage_colours import recolour
from ..scene.write import aspects_of, coverage_of
from .layout import RowList, draw_list, draw_reason, draw_sentence
from .properties import complaint
from .scene_status import not_evaluated
from .work import ForPlacement, ShortWork

OTHER_TARGETS = "The two placements were made on different targets: only their figures can be compared."


class SEIP_OT_keep_placement(ForPlacement, ShortWork, bpy.types.Operator):
    """Keep the present placement, to compare later ones with it; its name in the list can be changed"""

    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="Name", description="Name of the kept placement; numbered if empty")

    obstacles = (*ForPlacement.obstacles, not_evaluated)

    def act(self, context: bpy.types.Context) -> None:
        """Keep it, in place of another of that name."""
        seip = context.scene.seip
        free = (f"Placement {number}" for number in count(1))
        name = self.name.strip() or next(name for name in free if name not in seip.kept)
        entry = seip.kept.get(name) or seip.kept.add()
        entry.name = name
        for field in ("record", "targets", "seen"):
            setattr(entry, field, getattr(seip.result, field))
        seip.active_kept = seip.kept.find(name)


class SEIP_OT_show_comparison(ForPlacement, ShortWork, bpy.types.Operator):
    """Colour the road by the placements that see it: both, only the kept one, only the present one or neither"""

    bl_label = "Show Difference"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        """Colour the road."""
        scene = context.scene
        seip = scene.seip
        if not 0 <= seip.active_kept < len(seip.kept):
            raise SeipError("keep a placement first, to compare the present one with it")
        kept = seip.kept[seip.active_kept]
        if kept.targets != seip.result.targets:
            raise SeipError(OTHER_TARGETS)
        recolour(scene, compare(unpacked_counts(kept.seen), unpacked_counts(seip.result.seen)))
        scene.seip.view.legend = True


class SEIP_UL_kept(RowList, bpy.types.UIList):
    """Placements that were kept."""

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a name that can be changed."""
        layout.prop(item, "name", text="", emboss=False)


def draw_comparison(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the kept placements, and the present one beside the active one of them."""
    seip = context.scene.seip
    row = layout.row()
    draw_list(row, SEIP_UL_kept, seip, "kept", "active_kept")
    column = row.column(align=True)
    column.operator("seip.keep_placement", text="", icon="ADD")
    column.operator("seip.remove_entry", text="", icon="REMOVE").of = "KEPT"
    if not 0 <= seip.active_kept < len(seip.kept):
        draw_sentence(layout, "Keep this placement with +, place again, and compare the two.", icon="INFO")
        return
    kept, present = seip.kept[seip.active_kept], seip.result
    if draw_reason(layout, complaint(lambda: parsed_record(kept.record))):
        return
    _draw_table(layout, parsed_record(kept.record), parsed_record(present.record))
    if draw_reason(layout, OTHER_TARGETS if kept.targets != present.targets else ""):
        return
    layout.operator("seip.show_comparison")
    if (obj := coverage_of(context.scene)) is not None:
        layout.operator("seip.colour_coverage", text="Show Coverage").aspect = aspects_of(obj)[0]


def _draw_table(layout: bpy.types.UILayout, kept: PlacementRecord, present: PlacementRecord) -> None:
    grid = layout.grid_flow(row_major=True, columns=3, even_columns=True, align=True)
    for text in ("", "Kept", "Present"):
        grid.label(text=text)
    returns = ("Returns", _returns(kept), _returns(present))
    for name, one, other in (
        *([returns] if kept.returns or present.returns else []),
        ("Road Seen", _share(kept.coverage.whole), _share(present.coverage.whole)),
        ("Central", _share(kept.coverage.central), _share(present.coverage.central)),
        ("Price", kept.price_text, present.price_text),
        ("Sensors", str(len(kept.sensors)), str(len(present.sensors))),
    ):
        for text in (name, one, other):
            grid.label(text=text)


def _returns(record: PlacementRecord) -> str:
    return "–" if record.returns is None else returns_text(record.returns.typical)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.2%}"
