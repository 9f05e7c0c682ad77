"""Surfaces of a street from the lanes of a map: carriageways, pavements, kerbs and lane markings."""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from ...base.arrays import Float, Integer
from ...geometry.plan import closed, outline, signed_area, united, without
from ..opendrive.lanes import LaneSurface
from .terrain import Terrain, cut

GROUPS = {
    "driving": "driving", "entry": "driving", "exit": "driving", "onRamp": "driving", "offRamp": "driving",
    "connectingRamp": "driving", "slipLane": "driving", "bidirectional": "driving", "bus": "driving",
    "taxi": "driving", "HOV": "driving", "mwyEntry": "driving", "mwyExit": "driving",
    "shoulder": "shoulder", "stop": "shoulder", "restricted": "shoulder", "roadWorks": "shoulder",
    "special1": "shoulder", "special2": "shoulder", "special3": "shoulder", "shared": "shoulder",
    "parking": "parking",
    "biking": "biking",
    "border": "border", "curb": "border",
    "sidewalk": "sidewalk", "walking": "sidewalk",
    "median": "median",
    "tram": "track", "rail": "track",
}  # fmt: skip
"""Group of each OpenDRIVE lane type (ASAM OpenDRIVE 1.8, table of e_laneType); ``none`` has no surface."""

CARRIAGEWAY = ("driving", "shoulder", "parking", "biking", "track")
NOT_DRIVEN = ("border", "sidewalk", "median")
MAX_STEP = 10.0
CORNER_NOTCH = 3.0  # notches up to twice this (metres) at the corners of a junction are pavement
MAX_CORNER, MAX_ENDS = 40.0, 20.0
"""A corner is no longer than this along the carriageway, and along the pavements at its two ends (metres)."""
JUNCTION_SPACING = 4.0
KERB_HEIGHT = 0.12
KERB_DEPTH = 0.35
SNAP_GRID = 1e-4  # grid (metres) that plans snap to when they are joined
MIN_LOOSE_AREA = 400.0  # m²: pieces of streets, with pavements, that reach less into a scene are left out
MAX_SEAM = 0.05  # gaps up to twice this (metres) between the lanes of two roads are closed in outlines
MAX_OVERLAP = 0.002  # overlaps up to twice this wide (metres) are rounding of edges that meet
MAX_FOLD = 0.1  # square metres of a road's lanes that may lie on each other, as rounding
MAX_HOLE = 4.0  # m²: smaller holes of a carriageway are not islands
MAX_ISLAND_AREA = 400.0  # holes of the carriageway smaller than this (m²) are islands, on which no post is assumed
MAX_MEDIAN_WIDTH = 12.0  # holes narrower than this (metres) are medians: likewise
MAX_OPEN_MEDIAN_WIDTH = 6.0  # narrower gaps (metres) between carriageways are medians though no junction closes them
MAX_PAVEMENT_DISTANCE = 6.0  # metres: pavements this near belong to the carriageway, whatever is between
SIDE_STEP, MIN_SIDE_LENGTH = 2.0, 10.0  # metres: sampling step along sides of roads, and least side without pavement


@dataclass(frozen=True, eq=False)
class Roadside:
    """The carriageway and its sides, in local axes.

    Parameters
    ----------
    carriageway : shapely geometry
        Area of the lanes for vehicles.
    filled : shapely geometry
        The carriageway with its islands and medians: holes within junctions, small or narrow holes, and narrow gaps.
    mouths : shapely geometry
        Lines across the carriageway where lanes end and the road continues.
    """

    carriageway: BaseGeometry
    filled: BaseGeometry
    mouths: BaseGeometry

    def sides(self) -> BaseGeometry:
        """Return the edges of the filled carriageway, as lines, without its mouths."""
        edges = without(shapely.boundary(self.filled), self.mouths.buffer(2 * MAX_SEAM))
        return shapely.line_merge(edges) if edges.geom_type == "MultiLineString" else edges


def roadside(surfaces: Sequence[LaneSurface], carriageway: BaseGeometry | None = None) -> Roadside:
    """Return the carriageway of lanes and its sides.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        Lanes in local axes.
    carriageway : shapely geometry, optional
        Area of the carriageway; by default that of the lanes.

    Examples
    --------
    >>> def strip(number, kind, left, right):
    ...     s, zero = np.array([0.0, 100.0]), np.zeros(2)
    ...     edges = (np.column_stack([s, zero + y, zero]) for y in (left, right))
    ...     return LaneSurface("1", None, 0, number, kind, False, s, *edges)
    >>> lanes = strip(-1, "driving", 0.0, -3.5), strip(-2, "sidewalk", -3.5, -6.0)
    >>> street = roadside(lanes)
    >>> round(street.carriageway.area), round(street.sides().length)
    (350, 200)
    >>> round(bare_sides(street, pavement=lanes[1].polygon).length)
    100
    """
    paved = in_groups(surfaces, CARRIAGEWAY)
    join: Literal["mitre", "round"] = "mitre" if carriageway is None else "round"
    carriageway = lane_outline(paved) if carriageway is None else carriageway
    junctions = sorted({lane.junction_id for lane in paved if lane.junction_id is not None})
    inside = [lane_outline([lane for lane in paved if lane.junction_id == junction]) for junction in junctions]
    whole = shapely.union_all([carriageway, *map(without_holes, inside)])
    # Morphological closing fills gaps between carriageways that are open at an end, and therefore not holes.
    medians = without(closed(whole, MAX_OPEN_MEDIAN_WIDTH / 2, join), whole)
    filled = without_holes(closed(whole.union(medians), MAX_SEAM), least=MAX_ISLAND_AREA, narrow=MAX_MEDIAN_WIDTH)
    # A lane that ends at the edge of the filled area leads out of the model: there the edge is not a side of the road.
    # Ends of lanes where another lane follows lie inside, and only touch the edge with a corner.
    ends = [lane.left[[row], :2].tolist() + lane.right[[row], :2].tolist() for lane in paved for row in (0, -1)]
    across = shapely.linestrings(np.array(ends).reshape(-1, 2, 2))
    at_edge = shapely.length(shapely.intersection(across, shapely.boundary(filled).buffer(2 * MAX_SEAM)))
    length = shapely.length(across)
    return Roadside(carriageway, filled, shapely.union_all(across[(length > 2 * MAX_SEAM) & (at_edge > length / 2)]))


def bare_sides(roadside: Roadside, pavement: BaseGeometry, distance: float = MAX_PAVEMENT_DISTANCE) -> BaseGeometry:
    """Return the sides of the carriageway without a pavement within a distance in metres, as lines."""
    sides = roadside.sides()
    if pavement.is_empty or sides.is_empty:
        return sides
    # For each short piece of a side take the rectangle next to it. The side is bare where no pavement meets it.
    start, stop, outwards = side_pieces(roadside)
    outwards = distance * outwards
    strips = shapely.polygons(np.stack([start, stop, stop + outwards, start + outwards], axis=1))
    shapely.prepare(pavement)
    is_bare = ~shapely.intersects(pavement, strips)
    bare = shapely.line_merge(shapely.multilinestrings(np.stack([start, stop], axis=1)[is_bare]))
    return shapely.union_all([line for line in shapely.get_parts(bare) if line.length >= MIN_SIDE_LENGTH])


def side_pieces(roadside: Roadside) -> tuple[Float, Float, Float]:
    """Return starts and ends of short pieces of the sides, and the directions away from the road, (n, 2) each."""
    pieces = shapely.get_parts(shapely.segmentize(roadside.sides(), SIDE_STEP))
    lines = [np.empty((0, 2)), *(shapely.get_coordinates(line) for line in pieces)]
    start, stop = (np.concatenate([line[cut] for line in lines]) for cut in (slice(-1), slice(1, None)))
    along = (stop - start) / np.linalg.norm(stop - start, axis=1, keepdims=True)
    aside = np.column_stack([-along[:, 1], along[:, 0]])
    # A test point just left of the piece tells which way is out.
    inner = shapely.contains_xy(roadside.filled, (start + stop) / 2 + 2 * MAX_SEAM * aside)
    return start, stop, np.where(inner[:, None], -aside, aside)


def without_gaps(roadside: Roadside, surfaces: Sequence[LaneSurface]) -> BaseGeometry:
    """Return the holes of the carriageway that are too small for islands.

    These are gaps between turning lanes in a junction that no lane of a different kind covers.
    """
    holes = without(without_holes(roadside.carriageway, least=MAX_HOLE), roadside.carriageway)
    return holes if holes.is_empty else without(holes, _plan(in_groups(surfaces, NOT_DRIVEN)))


def _is_corner(notch: BaseGeometry, kerb: BaseGeometry, walked: BaseGeometry) -> bool:
    """Return whether a notch lies at a corner between the ends of pavements, and only briefly along each."""
    along = notch.buffer(2 * MAX_SEAM)
    return bool(kerb.intersection(along).length <= MAX_CORNER and walked.intersection(along).length <= MAX_ENDS)


def without_holes(area: BaseGeometry, *, least: float = np.inf, narrow: float = 0.0) -> BaseGeometry:
    """Return the area without holes smaller than ``least`` m² (all by default) or narrower than ``narrow`` metres."""

    def kept(hole: shapely.LinearRing) -> bool:
        inside = shapely.Polygon(hole)
        # Shrinking by half a width erases a hole exactly if it is nowhere wider than that.
        return bool(inside.area >= least and not inside.buffer(-narrow / 2).is_empty)

    parts = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon"]
    return shapely.union_all([shapely.Polygon(part.exterior, list(filter(kept, part.interiors))) for part in parts])


def local_strips(
    surfaces: Iterable[LaneSurface], origin: Float, area: BaseGeometry, *, kerbs: bool = True
) -> tuple[LaneSurface, ...]:
    """Return the lanes near an area, in local axes, with rows of points at most `MAX_STEP` apart.

    Parameters
    ----------
    surfaces : iterable of LaneSurface
        Lanes in map coordinates.
    origin : (3,) float64, metres
        Map coordinates of the local origin.
    area : shapely geometry
        Area in local axes. Rows are kept whole, so that lanes end a little beyond it.
    kerbs : bool
        Whether pavements are raised that are level with the road in the map.
    """
    shapely.prepare(area)
    moved = (
        dataclasses.replace(surface, left=surface.left - origin, right=surface.right - origin)
        for surface in surfaces
        if surface.lane_type in GROUPS
    )
    near = [surface for surface in moved if is_near(surface, area)]
    trimmed = (_trimmed(_densified(surface), area) for surface in (_with_kerbs(near) if kerbs else near))
    return tuple(surface for surface in trimmed if len(surface.left) > 1)


def cut_along(surface: LaneSurface, low: float, high: float) -> LaneSurface | None:
    """Return the part of a lane between two stations along the road, metres; None if it is empty."""
    if high <= low:
        return None
    known = np.arange(len(surface.s))
    inside = known[(surface.s > low) & (surface.s < high)]
    ends = np.interp([low, high], surface.s, known)
    return _at_rows(surface, np.concatenate([ends[:1], inside, ends[1:]]))


def without_loose_ends(
    surfaces: Sequence[LaneSurface], region: BaseGeometry, extent: BaseGeometry
) -> tuple[LaneSurface, ...]:
    """Return the lanes without small, disconnected pieces of roads outside the region."""
    plan = [shapely.make_valid(surface.polygon) for surface in surfaces]
    # Connected parts of all lanes, pavements included. A part that does not reach the region and has little area within
    # the extent is the cut end of a street that passes by.
    parts = shapely.get_parts(closed(shapely.union_all(plan, grid_size=SNAP_GRID), MAX_SEAM))
    loose = [part for part in parts if not part.intersects(region) and part.intersection(extent).area < MIN_LOOSE_AREA]
    away = shapely.union_all(loose)
    shapely.prepare(away)
    lost = shapely.covers(away.buffer(MAX_SEAM), plan)
    return tuple(surface for surface, is_lost in zip(surfaces, lost, strict=True) if not is_lost)


def with_rows_at(surface: LaneSurface, places: Float) -> LaneSurface:
    """Return a lane with additional rows of points at stations (n,) along the road, metres, within its range."""
    known = np.arange(len(surface.s))
    inside = places[(places > surface.s[0]) & (places < surface.s[-1])]
    return _at_rows(surface, np.unique(np.concatenate([known, np.interp(inside, surface.s, known)])))


def group(surface: LaneSurface) -> str | None:
    """Return the group of a lane's type, None for types without a surface."""
    return GROUPS.get(surface.lane_type)


def in_groups(surfaces: Iterable[LaneSurface], groups: Sequence[str]) -> tuple[LaneSurface, ...]:
    """Return the lanes that belong to the given groups."""
    return tuple(surface for surface in surfaces if group(surface) in groups)


def by_road(surfaces: Iterable[LaneSurface]) -> dict[str, list[LaneSurface]]:
    """Return the lanes by road id."""
    roads: dict[str, list[LaneSurface]] = {}
    for surface in surfaces:
        roads.setdefault(surface.road_id, []).append(surface)
    return roads


def is_near(surface: LaneSurface, area: BaseGeometry) -> bool:
    """Return whether the bounding box of a lane meets an area in plan."""
    points = np.concatenate([surface.left, surface.right])[:, :2]
    return bool(area.intersects(shapely.box(*points.min(axis=0), *points.max(axis=0))))


def lane_outline(surfaces: Iterable[LaneSurface]) -> BaseGeometry:
    """Return the area in plan that lanes cover, with seams closed and crumbs removed."""
    return without_crumbs(closed(_plan(surfaces), MAX_SEAM).simplify(0.01))


def without_crumbs(area: BaseGeometry, least: float = 0.5) -> BaseGeometry:
    """Return the area without parts and holes smaller than ``least`` square metres."""
    parts = [part for part in shapely.get_parts(area) if part.area >= least]
    return without_holes(shapely.geometrycollections(parts), least=least)


class SurfaceLayers:
    """Surfaces of lanes laid one after another, each without the area that earlier ones cover.

    Lanes of a map overlap in junctions, where roads merge, and in maps made from centre lines. Two faces in one place
    are drawn as black slivers, and both count in areas.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        All lanes, in local axes.
    extent : shapely geometry
        Area to which the surfaces are cut.
    """

    def __init__(self, surfaces: Sequence[LaneSurface], extent: BaseGeometry) -> None:
        self._surfaces = surfaces
        self._beyond = shapely.box(*extent.buffer(10 * MAX_STEP).bounds).difference(extent)
        self._laid: list[BaseGeometry] = []

    @property
    def area(self) -> BaseGeometry:
        """Area in plan covered so far."""
        return united(self._laid)

    def lay(self, triangles: Float, plan: BaseGeometry) -> Float:
        """Lay triangles (n, 3, 3) with a known outline in plan, and return the part not covered before (m, 3, 3)."""
        near = [area for area in self._laid if area.intersects(plan)]
        if near:
            covered = united(near)
            # Edges that meet overlap by rounding: cutting these would make slivers. Only an overlap of some width is
            # cut.
            if not shapely.intersection(covered, plan, grid_size=SNAP_GRID).buffer(-MAX_OVERLAP).is_empty:
                triangles, plan = cut(triangles, covered), without(plan, covered)
        if not plan.is_empty:
            self._laid.append(plan)
        return triangles

    def lay_group(self, name: str) -> Float:
        """Lay the lanes of one group and return their surface within the extent, (n, 3, 3).

        Lanes that cross each other in a junction differ in height by some centimetres: there the group is replaced by
        one layer at their mean height, and groups other than driving lanes are cut by these. Elsewhere lanes meet edge
        to edge and stay as they are, unless they overlap themselves in a narrow bend.
        """
        lanes = in_groups(self._surfaces, [name])
        junctions = sorted({lane.junction_id for lane in lanes if lane.junction_id is not None})
        inside = [self._lay_junction(name, [lane for lane in lanes if lane.junction_id == one]) for one in junctions]
        roads = by_road([lane for lane in lanes if lane.junction_id is None])
        outside = [self._lay_road(own) for own in roads.values()]
        return cut(np.concatenate([np.empty((0, 3, 3)), *outside, *inside]), self._beyond)

    def _lay_road(self, lanes: Sequence[LaneSurface]) -> Float:
        triangles = np.concatenate([lane.triangles for lane in lanes])
        plan = outline(triangles, SNAP_GRID)
        # Triangles that cover more area than their outline lie on each other: replace them by one layer over the
        # outline.
        if np.abs(signed_area(triangles)).sum() > plan.area + MAX_FOLD:
            triangles = Terrain(triangles).drape(plan, spacing=JUNCTION_SPACING)
        return self.lay(triangles, plan)

    def _lay_junction(self, name: str, lanes: Sequence[LaneSurface]) -> Float:
        area = lane_outline(lanes)
        if name != "driving":
            number = lanes[0].junction_id
            driving = [lane for lane in in_groups(self._surfaces, ["driving"]) if lane.junction_id == number]
            area = without_crumbs(without(area, _plan(driving)))
        terrain = Terrain(np.concatenate([lane.triangles for lane in lanes]))
        return self.lay(terrain.drape(area, spacing=JUNCTION_SPACING), area)


def kerb_faces(pavement: Float, step: float | None = None) -> Float:
    """Return (n, 3, 3) vertical triangles below the edge of a pavement's triangles (m, 3, 3).

    The edge follows the height of the pavement at its corners in plan and, with a ``step``, also at points at most
    that many metres apart.
    """
    if len(pavement) == 0:
        return pavement
    plan = without_crumbs(closed(outline(pavement, SNAP_GRID), MAX_SEAM).simplify(0.01))
    plan = plan if step is None else shapely.segmentize(plan, step)
    terrain = Terrain(pavement)
    # Counter-clockwise outer rings and clockwise holes have the pavement at their left, so that kerbs face outwards.
    parts = map(orient, shapely.get_parts(plan))
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return np.concatenate([_skirt(ring, terrain) for ring in rings])


def corner_pavements(pavement: Float, surfaces: Sequence[LaneSurface], carriageway: BaseGeometry) -> Float:
    """Return (n, 3, 3) triangles that close pavements (m, 3, 3) at the corners of junctions.

    In many maps pavements end where the junction begins. A notch between the ends of two pavements and the carriageway
    is filled at the height of the pavements, unless the map has another pavement there: within the junction, or next to
    the carriageway beyond a verge. Medians are not corners.
    """
    inside = _plan([lane for lane in in_groups(surfaces, CARRIAGEWAY) if lane.junction_id is not None])
    if inside.is_empty or len(pavement) == 0:
        return np.empty((0, 3, 3))
    walked = outline(pavement, SNAP_GRID)
    own = _plan([lane for lane in in_groups(surfaces, ["sidewalk"]) if lane.junction_id is not None])
    kerb = shapely.boundary(carriageway)
    # Morphological closing of the whole street fills the concave corners between lanes; what it adds are the notches.
    # Corners touch a junction and a pavement, are away from pavements within the junction, and are short along the
    # kerb.
    street = closed(_plan(surfaces).union(walked, grid_size=SNAP_GRID), MAX_SEAM)
    notches = without(closed(street, CORNER_NOTCH), street)
    corners = [
        notch
        for notch in shapely.get_parts(notches)
        if notch.area > 1.0
        and notch.distance(inside) < MAX_SEAM
        and notch.distance(walked) < MAX_SEAM
        and not notch.distance(own) < CORNER_NOTCH
        and _is_corner(notch, kerb, shapely.boundary(walked))
    ]
    return Terrain(pavement).drape(shapely.union_all(corners), spacing=MAX_STEP)


def inner_edge(lane: LaneSurface) -> Float:
    """Return the edge (n, 3) of a lane nearer to the reference line."""
    return lane.right if lane.lane_id > 0 else lane.left


def outer_edge(lane: LaneSurface) -> Float:
    """Return the edge (n, 3) of a lane farther from the reference line."""
    return lane.left if lane.lane_id > 0 else lane.right


def _with_kerbs(surfaces: Sequence[LaneSurface]) -> tuple[LaneSurface, ...]:
    """Return the lanes with pavements raised to kerb height, if all pavements of the map are level with the road.

    Maps without lane heights, such as the towns of CARLA, mean pavements that are raised in the street; 0.12 m is the
    usual height of a kerb.
    """
    inner_neighbour = {
        (lane.road_id, lane.section, lane.lane_id + (1 if lane.lane_id > 0 else -1)): lane for lane in surfaces
    }
    steps = [0.0]
    for lane in in_groups(surfaces, ["sidewalk"]):
        neighbour = inner_neighbour.get((lane.road_id, lane.section, lane.lane_id))
        if neighbour is not None and len(neighbour.left) == len(lane.left):
            steps.append(float(np.median(inner_edge(lane)[:, 2] - outer_edge(neighbour)[:, 2])))
    # One pavement that is raised shows that the map has lane heights: then all are left as they are.
    if max(steps) > KERB_HEIGHT / 4:
        return tuple(surfaces)
    up = np.array([0.0, 0.0, KERB_HEIGHT])
    return tuple(
        dataclasses.replace(lane, left=lane.left + up, right=lane.right + up) if group(lane) == "sidewalk" else lane
        for lane in surfaces
    )


def _plan(surfaces: Iterable[LaneSurface]) -> BaseGeometry:
    return shapely.union_all([shapely.make_valid(surface.polygon) for surface in surfaces], grid_size=SNAP_GRID)


def _densified(surface: LaneSurface) -> LaneSurface:
    steps = np.hypot(*np.diff((surface.left + surface.right)[:, :2] / 2, axis=0).T)
    pieces = np.maximum(1, np.ceil(steps / MAX_STEP).astype(int))
    return _at_rows(surface, np.concatenate([[0.0], *(i + np.arange(1, k + 1) / k for i, k in enumerate(pieces))]))


def _at_rows(surface: LaneSurface, rows: Float) -> LaneSurface:
    known = np.arange(len(surface.s))
    left, right = (interpolated(rows, known, edge) for edge in (surface.left, surface.right))
    return dataclasses.replace(surface, s=np.interp(rows, known, surface.s), left=left, right=right)


def interpolated(at: Float, known: Float | Integer, points: Float) -> Float:
    """Return points (k, 3) at stations (k,), interpolated between points (n, 3) at ascending stations (n,)."""
    return np.column_stack([np.interp(at, known, points[:, axis]) for axis in range(3)])


def _trimmed(surface: LaneSurface, area: BaseGeometry) -> LaneSurface:
    left, right = surface.left[:, :2], surface.right[:, :2]
    corners = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
    hit = np.flatnonzero(shapely.intersects(area, shapely.convex_hull(shapely.multipoints(corners))))
    rows = slice(hit[0], hit[-1] + 2) if len(hit) else slice(0, 0)
    return dataclasses.replace(surface, s=surface.s[rows], left=surface.left[rows], right=surface.right[rows])


def _skirt(ring: shapely.LinearRing, terrain: Terrain) -> Float:
    """Return vertical faces below a ring with the area at its left; they face right."""
    plan = np.asarray(ring.coords)[:, :2]
    height = terrain.height(plan)
    high, low = np.column_stack([plan, height]), np.column_stack([plan, height - KERB_DEPTH])
    quads = np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def junctions_in_plan(surfaces: Sequence[LaneSurface]) -> BaseGeometry:
    """Return the area of the driving lanes in junctions."""
    return _plan([lane for lane in in_groups(surfaces, ["driving"]) if lane.junction_id is not None])
