"""Areas in which faces of a modelled site lie on each other, face by face."""

from collections import Counter

import numpy as np
import shapely

from seip_addon.core.geometry.plan import plane_height, signed_area
from seip_addon.core.site.roles import AREA_OVERLAYS, Role

STEEP = 0.3  # cosine of the slope from which on a face is no surface to walk or drive on
LEAST = 1e-6  # square metres
MAX_OVERLAP = 0.2  # m² of pavement in lanes: rounding along hundreds of metres of edges
MAX_HOLE = 4.0  # m²: smaller holes in the carriageway are no islands
MAX_COINCIDENT = 0.5  # m² of faces in one place, of a site of some 10,000 m²


def triangles(part):
    """Return the faces (n, 3, 3) of a part in local axes, as fans."""
    cos, sin = np.cos(part.yaw), np.sin(part.yaw)
    corners = part.solid.vertices @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + np.array(part.foot)
    fans = [(face[0], *face[i : i + 2]) for face in part.solid.faces for i in range(1, len(face) - 1)]
    return corners[np.array(fans, dtype=int).reshape(-1, 3)]


def lying(faces):
    """Return the triangles that are not steep."""
    area = np.abs(signed_area(faces))
    whole = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1) / 2
    return faces[(area > LEAST) & (area > STEEP * whole)]


def plan(parts):
    """Return the area in plan of parts."""
    faces = np.concatenate([np.empty((0, 3, 3)), *(lying(triangles(part)) for part in parts)])
    return shapely.union_all(shapely.polygons(faces[:, :, :2]), grid_size=1e-4)


def surfaces(model):
    """Return the parts of a model that lie on the ground and are rendered."""
    return [
        part
        for part in model.parts
        if {role.name for role in part.roles} & {"ROADS", "GROUND", "DRESSING"}
        and not part.of
        and not set(part.roles) <= AREA_OVERLAYS.keys()
    ]


def coincident_areas(parts, within=1e-3):
    """Return by pair of names (of one part, too) the area in which two faces are no farther apart than so much."""
    faces = [lying(triangles(part)) for part in parts]
    names = np.repeat([part.name for part in parts], [len(each) for each in faces])
    faces = np.concatenate(faces)
    plans = shapely.polygons(faces[:, :, :2])
    first, second = shapely.STRtree(plans).query(plans, predicate="intersects")
    first, second = first[first < second], second[first < second]
    common = shapely.intersection(plans[first], plans[second])
    found = Counter()
    for a, b, shared in zip(first, second, common, strict=True):
        if shared.geom_type == "Polygon" and shared.area > LEAST:
            xy = shapely.get_coordinates(shared)[:-1]
            gap = np.subtract(*(plane_height(np.broadcast_to(faces[i], (len(xy), 3, 3)), xy) for i in (a, b)))
            near = _kept(_kept(np.column_stack([xy, gap]), 1.0, within), -1.0, within)
            if len(near) > 2:
                found[tuple(sorted((names[a], names[b])))] += shapely.Polygon(near[:, :2]).area
    return found


def check_surfaces(model):
    """No pavement or place for posts lies in a lane, lanes leave no small holes, no two faces lie in one place."""
    roads = plan([part for part in model.parts if Role.ROADS in part.roles])
    walked = plan([part for part in model.parts if part.name.startswith("Pavements")])
    posts = plan([part for part in model.parts if Role.CANDIDATE_AREAS in part.roles])
    assert walked.intersection(roads).area < MAX_OVERLAP
    assert posts.intersection(roads).area < MAX_OVERLAP
    holes = [shapely.Polygon(ring).area for part in shapely.get_parts(roads) for ring in part.interiors]
    assert sum(hole for hole in holes if hole < MAX_HOLE) < MAX_OVERLAP
    found = coincident_areas(surfaces(model))
    assert sum(found.values()) < MAX_COINCIDENT, found


def _kept(corners, sign, most):
    """Return a convex polygon (n, 3) cut where its third coordinate times a sign exceeds a limit."""
    over = most - sign * corners[:, 2] if len(corners) else corners
    kept = []
    for i in range(len(corners)):
        j = (i + 1) % len(corners)
        if over[i] >= 0:
            kept.append(corners[i])
        if (over[i] >= 0) != (over[j] >= 0):
            kept.append(corners[i] + (corners[j] - corners[i]) * over[i] / (over[i] - over[j]))
    return np.array(kept).reshape(-1, 3)
