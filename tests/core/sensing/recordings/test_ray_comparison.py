"""Objects that a scene lacks, and objects that are no longer there."""

import numpy as np
import pytest
import shapely
import shapely.affinity

from seip_addon.core.sensing.recordings.comparison import (
    AGREES,
    FARTHER,
    NEARER,
    NOTHING,
    UNKNOWN,
    compare_rays,
    gone_objects,
    new_objects,
)
from tests.builders.scanned_street import box_mesh, ground_mesh, mounted, street_background, street_meshes, surface_of

SENSORS = (mounted("os1_64_rev7"), mounted("os1_64_rev7", (10.0, 8.0, 5.0), 1.2, "S2"))
PLAN = (ground_mesh(), *street_meshes())


def comparisons(planned, real):
    """Compare the rays of a real street with a planned one."""
    surface, recorded = surface_of(planned), surface_of(real)
    found = [compare_rays(surface, one, street_background(recorded, one, seed=n)) for n, one in enumerate(SENSORS)]
    return found, surface.caster.triangles


def no_road(xy):
    """Return no height of a road."""
    return np.full(len(xy), np.nan)


def test_nothing_has_changed_in_an_unchanged_street():
    found, triangles = comparisons(PLAN, PLAN)
    assert new_objects(found, no_road) == []
    assert gone_objects(found, PLAN[1:], triangles) == []
    for one in found:
        share = np.bincount(one.result, minlength=5) / len(one.result)
        assert share[NEARER] + share[FARTHER] < 1e-4
        assert ((one.triangle < 0) == (one.result == UNKNOWN)).all()
        agrees = one.result == AGREES
        assert np.abs(one.measured - one.predicted)[agrees].max() < 1.0
        assert np.isnan(one.measured[one.result == NOTHING]).all()


def test_added_boxes_are_found_with_place_and_size():
    added = (
        box_mesh("kiosk", 0.0, 18.0, 4.0, 3.0, 3.0, 0.4, 0.0),
        box_mesh("cabinet", -4.0, -14.0, 2.0, 0.8, 1.6, 1.2),
    )
    found, triangles = comparisons(PLAN, (*PLAN, *added))
    changes = new_objects(found, no_road)
    assert [change.rays for change in changes] == sorted((change.rays for change in changes), reverse=True)
    outlines = [shapely.MultiPoint(mesh.triangles.reshape(-1, 3)[:, :2]).convex_hull for mesh in added]
    shown = [[change for change in changes if shapely.Point(change.box[:2]).within(outline)] for outline in outlines]
    assert sum(map(len, shown)) == len(changes) <= 3  # sides that face different sensors may be two objects
    for mesh, own, outline in zip(added, shown, outlines, strict=True):
        assert {change.kind for change in own} == {"new"}
        for change in own:
            x, y, z, length, width, height, yaw = change.box
            rectangle = shapely.affinity.rotate(
                shapely.box(-length / 2, -width / 2, length / 2, width / 2), yaw, use_radians=True
            )
            around = shapely.affinity.translate(rectangle, x, y)
            assert around.difference(outline.buffer(0.75)).area < 0.1
            assert z + height / 2 == pytest.approx(mesh.triangles[..., 2].max(), abs=0.2)
            assert z - height / 2 > -0.3
    assert gone_objects(found, PLAN[1:], triangles) == []


def test_removed_objects_are_found_by_name_with_their_triangles():
    gone = ("north-west", "post 0")
    real = tuple(mesh for mesh in PLAN if mesh.name not in gone)
    found, triangles = comparisons(PLAN, real)
    changes = gone_objects(found, PLAN[1:], triangles)
    assert [change.name for change in changes] == ["north-west", "post 0"]  # most rays first
    assert changes[0].rays > changes[1].rays
    for change in changes:
        (mesh,) = [mesh for mesh in PLAN if mesh.name == change.name]
        own = {row.tobytes() for row in mesh.triangles}
        assert {row.tobytes() for row in triangles[change.part]} == own
        assert change.box[:2] == pytest.approx(mesh.triangles.reshape(-1, 3)[:, :2].mean(axis=0), abs=0.1)
    assert new_objects(found, no_road) == []


def test_leaves_over_the_road_are_part_of_the_tree_and_a_standing_motorcycle_is_not():
    tree = box_mesh("tree", 0.0, 19.8, 2.4, 1.6, 6.0)
    motorcycle = box_mesh("motorcycle", 8.0, 17.5, 2.4, 0.8, 1.5)
    found, _ = comparisons(PLAN, (*PLAN, tree, motorcycle))

    def road(xy):
        return np.where((xy[:, 0] < -0.5) | (xy[:, 1] < 18.5), 0.0, np.nan)

    changes = new_objects(found, road)
    assert sorted(change.kind for change in changes) == ["new", "vehicle"]
    box = {change.kind: change.box for change in changes}
    assert np.hypot(*(box["new"][:2] - (0.0, 19.8))) < 1.0
    assert np.hypot(*(box["vehicle"][:2] - (8.0, 17.5))) < 1.0
