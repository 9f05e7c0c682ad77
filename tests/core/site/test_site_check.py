"""Each problem is found where it is, and a sound site has none."""

import dataclasses

import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.plan import outline
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.check import SceneContents, Surface, check_site
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.site.site import make_site
from tests.builders.plain_street import sheet

ROAD = Surface("roads", "road", sheet(-50, -4, 50, 4))
REGION = Surface("region", "region", sheet(-30, -5, 30, 5, 0.03))
PAVEMENT = Surface("candidate_areas", "pavement", sheet(-50, 4, 50, 7))
GEOMETRY = SceneGeometry(
    name="street",
    origin=np.zeros(3),
    roads=(Mesh("road", ROAD.triangles),),
    ground=(Mesh("pavement", PAVEMENT.triangles),),
    occluders=(),
    region=outline(REGION.triangles),
    candidate_areas=outline(PAVEMENT.triangles),
)
SITE = make_site(GEOMETRY, CandidateSettings(heights=(8.0,), spacing=12.0), 4.0)
SOUND = SceneContents((ROAD, REGION, PAVEMENT), (), GEOMETRY, ())


def found(*surfaces, poles=(), built=()):
    contents = SceneContents(tuple(surfaces), tuple(poles), GEOMETRY, (), built=frozenset(built))
    return [(p.severity, p.obj, p.text) for p in finish(check_site(contents, lambda _: (SITE, ()))).problems]


def moved(surface, x=0.0, y=0.0, z=0.0, name=None):
    return dataclasses.replace(surface, triangles=np.add(surface.triangles, (x, y, z)), name=name or surface.name)


def one(problems, words):
    (hit,) = [problem for problem in problems if words in problem[2]]
    return hit[:2]


def test_a_sound_site_has_no_problem():
    assert found(*SOUND.surfaces) == []


def test_a_region_beside_the_road_is_an_error_and_one_of_two_a_warning():
    beside = moved(REGION, y=200, name="beside")
    assert one(found(ROAD, beside, PAVEMENT), "no road within") == ("ERROR", "beside")
    assert one(found(*SOUND.surfaces, beside), "no road within") == ("WARNING", "beside")


def test_no_warning_is_about_an_object_that_the_builder_made():
    beside = moved(REGION, y=200, name="beside")
    far, twin = Pole("far", np.array([0.0, 500.0, 0.0])), Pole("twin", np.array([10.0, 5.0, 0.0]))
    same = dataclasses.replace(twin, name="same")
    users = {obj for _, obj, _ in found(*SOUND.surfaces, beside, poles=(far, twin, same))}
    assert users == {"beside", "far", "same"}
    assert found(*SOUND.surfaces, beside, poles=(far, twin, same), built=("beside", "far", "twin", "same")) == []
    assert [obj for _, obj, _ in found(*SOUND.surfaces, poles=(far, twin, same), built=("far", "same"))] == ["twin"]
    assert one(found(ROAD, beside, PAVEMENT, built=("beside",)), "no road within") == ("ERROR", "beside")
