"""City models as they are read: geometry exactly, levels of detail, parts, and what is refused."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.errors import SeipError
from seip_addon.core.world.citymodel import cityjson
from seip_addon.core.world.citymodel.cityjson import read_city_model
from seip_addon.core.world.citymodel.solids import building_solid
from tests.builders.city_text import CityModel


def solids(model, tmp_path, **changed):
    read = read_city_model(model.write(tmp_path / "model.city.json", **changed))
    return [building_solid(read, building, "facade plaster") for building in read.buildings]


def volume(solid):
    """Volume by the divergence theorem: exact where the solid is closed."""
    corners = solid.vertices[np.array(solid.faces)]
    return float(np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def area(solid, material=None):
    chosen = [face for face, own in zip(solid.faces, solid.materials, strict=True) if material in (None, own)]
    corners = solid.vertices[np.array(chosen)]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(cross, axis=1).sum() / 2)


def is_closed(solid):
    edges = [(face[i], face[(i + 1) % 3]) for face in solid.faces for i in range(3)]
    return len(set(edges)) == len(edges) and all((b, a) in set(edges) for a, b in edges)


def test_a_gabled_house_keeps_its_volume_its_roof_and_its_walls(tmp_path):
    model = CityModel()
    (house,) = solids(model.add("a", model.gabled(5, 7, 10, 8, 6, 9)), tmp_path)
    assert volume(house) == pytest.approx(10 * 8 * 6 + 10 * 8 * 3 / 2)
    assert area(house, "roof") == pytest.approx(2 * 10 * 5)
    assert area(house, "facade plaster") == pytest.approx(10 * 8 + 2 * (10 + 8) * 6 + 8 * 3)
    assert np.ptp(house.vertices, axis=0) == pytest.approx([10, 8, 9])


@pytest.mark.parametrize("version", ["1.1", "1.1.3", "2.0", "2.0.1"])
@pytest.mark.parametrize("kind", ["Solid", "MultiSolid", "CompositeSolid", "MultiSurface", "CompositeSurface"])
def test_every_kind_of_geometry_gives_the_same_solid(kind, version, tmp_path):
    model = CityModel(version=version)
    block = model.block(0, 0, 4, 3, 5)
    block["type"] = kind
    if kind.endswith("Surface"):
        block["boundaries"], block["semantics"]["values"] = block["boundaries"][0], block["semantics"]["values"][0]
    elif kind != "Solid":
        block["boundaries"], block["semantics"]["values"] = [block["boundaries"]], [block["semantics"]["values"]]
    (solid,) = solids(model.add("a", block), tmp_path)
    assert volume(solid) == pytest.approx(60)
    assert area(solid, "roof") == pytest.approx(12)
    assert len(solid.faces) == 12


def test_holes_are_left_open_and_inner_shells_out(tmp_path):
    model = CityModel()
    outer = [(0, 0, 5), (10, 0, 5), (10, 10, 5), (0, 10, 5)]
    hole = [(3, 3, 5), (3, 6, 5), (6, 6, 5), (6, 3, 5)]
    plate = model.solid([[outer, hole]])
    plate["boundaries"].append(model.shell([outer]))
    (solid,) = solids(model.add("a", plate), tmp_path)
    assert area(solid) == pytest.approx(100 - 9)
    assert set(solid.materials) == {"roof"}


def test_the_highest_level_up_to_2_2_counts(tmp_path):
    model = CityModel()
    geometries = [model.block(0, 0, 4, 3, height, lod=lod) for lod, height in (("1.2", 5), ("2.2", 7), ("3", 9))]
    footprint = model.surfaces([[(0, 0, 0), (4, 0, 0), (4, 3, 0)]], lod="0")
    (solid,) = solids(model.add("a", footprint, *geometries), tmp_path)
    assert volume(solid) == pytest.approx(84)


def test_parts_are_one_building_and_a_coarser_whole_gives_way(tmp_path):
    model = CityModel()
    model.add("whole", model.block(0, 0, 10, 5, 9, lod="1.2"), children=["east", "west"])
    model.add("east", model.block(5, 0, 5, 5, 4, lod="2.2"), kind="BuildingPart", parents=["whole"])
    model.add("west", model.block(0, 0, 5, 5, 8, lod="2.2"), kind="BuildingPart", parents=["whole"])
    (solid,) = solids(model, tmp_path)
    assert volume(solid) == pytest.approx(5 * 5 * 12)


def test_a_whole_in_the_same_detail_stands_beside_its_parts(tmp_path):
    model = CityModel()
    model.add("whole", model.block(0, 0, 5, 5, 8, lod="2.2"), children=["balcony"])
    model.add("balcony", model.block(5, 0, 2, 5, 1, lod="2.2"), kind="BuildingInstallation", parents=["whole"])
    (solid,) = solids(model, tmp_path)
    assert volume(solid) == pytest.approx(5 * 5 * 8 + 10)


def test_other_objects_and_what_has_no_area_are_left_out(tmp_path):
    model = CityModel().add("footprint only")
    model.add("tree", model.block(0, 0, 1, 1, 1), kind="SolitaryVegetationObject")
    flat = [[(0, 0, 0), (4, 0, 0), (4, 0, 0)], [(0, 0, 0), (4, 0, 0), (8, 0, 0)]]
    model.add("flat", model.surfaces([*flat, [(0, 0, 3), (4, 0, 3), (4, 2, 3)]]))
    read = read_city_model(model.write(tmp_path / "model.json"))
    assert [building.id for building in read.buildings] == ["flat"]
    assert read.left_out.total() == 1
    assert len(building_solid(read, read.buildings[0], "wall").faces) == 1


@settings(max_examples=150, deadline=None)
@given(
    radii=st.lists(st.integers(2, 40), min_size=3, max_size=14),
    height=st.integers(1, 30),
    turn=st.floats(-3.1, 3.1),
    at=st.tuples(*[st.integers(-500_000, 500_000)] * 2),
)
def test_star_shaped_blocks_keep_volume_and_area_and_close(radii, height, turn, at, tmp_path_factory):
    """Against the shoelace formula; the places are those of the file, in millimetres."""
    angle = turn + np.arange(len(radii)) * (2 * np.pi / len(radii))
    plan = np.round(np.column_stack([radii * np.cos(angle), radii * np.sin(angle)]), 3) + at
    x, y = (plan - plan[0]).T
    shoelace = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)
    floor, top = ([(*xy, z) for xy in plan.tolist()] for z in (0.0, float(height)))
    count = len(plan)
    walls = [[floor[i], floor[(i + 1) % count], top[(i + 1) % count], top[i]] for i in range(count)]
    model = CityModel()
    block = model.solid([floor[::-1], top, *walls])
    places = {tuple(place): number for number, place in reversed(list(enumerate(model.vertices)))}
    shared = [[[places[tuple(model.vertices[i])] for i in ring] for ring in face] for face in block["boundaries"][0]]
    model.add("a", block | {"boundaries": [shared]})
    (solid,) = solids(model, tmp_path_factory.mktemp("city"))
    low = solid.vertices - solid.vertices.min(axis=0)
    assert volume(type(solid)(low, solid.faces, solid.materials)) == pytest.approx(shoelace * height, rel=1e-6)
    assert is_closed(solid)
    assert len(solid.faces) == 2 * (count - 2) + 2 * count


def house():
    model = CityModel()
    return model.add("a", model.block(0, 0, 4, 3, 5))


def spoilt(change):
    content = json.loads(json.dumps(house().content))
    change(content)
    return json.dumps(content)


def geometry(content):
    return content["CityObjects"]["a"]["geometry"][0]


def set_to(*keys_and_value):
    *keys, last, value = keys_and_value

    def change(content):
        for key in keys:
            content = content[key]
        content[last] = value

    return change


BROKEN = {
    "no file of JSON": ("{", "not readable JSON"),
    "nested without end": ("[" * 100_000, "not readable JSON"),
    "no text": (b"\xff\xfe\xfa", "not readable JSON"),
    "a sequence": (json.dumps(house().content) + "\n{}", "cjseq collect"),
    "NaN": (spoilt(set_to("vertices", 0, [float("nan"), 0, 0])), "it has the number NaN"),
    "infinite": (spoilt(set_to("vertices", 0, [float("inf"), 0, 0])), "it has the number Infinity"),
    "too far": (spoilt(set_to("vertices", 0, [1e300, 0, 0])), "coordinate of a vertex is"),
    "too high": (
        spoilt(set_to("vertices", 0, [0, 0, 10**9])),
        "height of a vertex is 1e\\+06, not -10,000 to 10,000 m",
    ),
    "a vast scale": (spoilt(set_to("transform", {"scale": [1e30] * 3, "translate": [0] * 3})), "a vertex is"),
    "a list": ("[]", "not CityJSON"),
    "another type": (spoilt(set_to("type", "FeatureCollection")), "not CityJSON"),
    "a feature": (spoilt(set_to("type", "CityJSONFeature")), "not CityJSON"),
    "an old version": (spoilt(set_to("version", "1.0")), "cjio .* upgrade"),
    "an unknown version": (spoilt(set_to("version", "9")), "'9'"),
    "no version": (spoilt(lambda content: content.pop("version")), "version"),
    "no vertices": (spoilt(lambda content: content.pop("vertices")), "vertices must be a list"),
    "no objects": (spoilt(lambda content: content.pop("CityObjects")), "CityObjects must be"),
    "objects in a list": (spoilt(set_to("CityObjects", [1])), "CityObjects must be"),
    "an object that is none": (spoilt(set_to("CityObjects", "a", 3)), "CityObjects must be"),
    "two numbers": (spoilt(set_to("vertices", 0, [1, 2])), "three numbers"),
    "words": (spoilt(set_to("vertices", 0, ["a", "b", "c"])), "three numbers"),
    "nothing": (spoilt(set_to("vertices", 0, [None, 1, 2])), "a vertex is nan, not"),
    "flat list": (spoilt(set_to("vertices", list(range(24 * 3)))), "three numbers"),
    "a transform that is none": (spoilt(set_to("transform", [1])), "three numbers"),
    "scale of two": (spoilt(set_to("transform", "scale", [1, 1])), "three numbers"),
    "an index too high": (spoilt(lambda c: set_to(0, 0, 0, 0, 24)(geometry(c)["boundaries"])), "names the vertex 24"),
    "an index below zero": (spoilt(lambda c: set_to(0, 0, 0, 0, -1)(geometry(c)["boundaries"])), "names the vertex -1"),
    "an index that is true": (spoilt(lambda c: set_to(0, 0, 0, 0, True)(geometry(c)["boundaries"])), "vertex True"),
    "a flat boundary": (spoilt(lambda c: set_to("boundaries", [1, 2])(geometry(c))), "lists of lists"),
    "no boundary": (spoilt(lambda c: geometry(c).pop("boundaries")), "lists of lists"),
    "semantics too high": (spoilt(lambda c: set_to(0, 0, 7)(geometry(c)["semantics"]["values"])), "a surface 7"),
    "semantics too few": (spoilt(lambda c: set_to(0, [0])(geometry(c)["semantics"]["values"])), "number of values"),
    "no level": (spoilt(lambda c: geometry(c).pop("lod")), "level of detail 'None'"),
    "a level that is none": (spoilt(lambda c: set_to("lod", "nan")(geometry(c))), "level of detail 'nan'"),
    "level 3 alone": (spoilt(lambda c: set_to("lod", "3")(geometry(c))), "no building with surfaces"),
    "geometry of one": (spoilt(set_to("CityObjects", "a", "geometry", {})), "list of tables"),
    "templates": (spoilt(lambda c: set_to("type", "GeometryInstance")(geometry(c))), "without templates"),
    "its own part": (spoilt(set_to("CityObjects", "a", "children", ["a"])), "parts of each other"),
    "a part that is not there": (spoilt(set_to("CityObjects", "a", "children", ["b"])), "'b' that is not there"),
    "children of one": (spoilt(set_to("CityObjects", "a", "children", "b")), "list of names"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_refused_in_one_sentence(name, tmp_path):
    text, complaint = BROKEN[name]
    path = tmp_path / "model.city.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SeipError, match=complaint) as refusal:
        read_city_model(path)
    assert "\n" not in str(refusal.value)


def test_cycles_of_parts_are_refused(tmp_path):
    for ring in ("ab", "abc"):
        model = house()
        for one, following in zip(ring, ring[1:] + ring[0], strict=True):
            model.add(one, model.block(0, 0, 1, 1, 1), kind="BuildingPart", children=[following])
        model.add("other", model.block(9, 9, 1, 1, 1))
        with pytest.raises(SeipError, match="parts of each other"):
            read_city_model(model.write(tmp_path / "model.json"))
    model = house()
    model.add("top", model.block(0, 0, 1, 1, 1), children=["a", "a"])
    with pytest.raises(SeipError, match="part twice"):
        read_city_model(model.write(tmp_path / "model.json"))


def test_a_file_that_is_not_there_or_too_large_is_refused(tmp_path, monkeypatch):
    with pytest.raises(SeipError, match="no such file"):
        read_city_model(tmp_path / "none.json")
    path = house().write(tmp_path / "model.json")
    monkeypatch.setattr(cityjson, "MAX_VERTICES", 20)
    with pytest.raises(SeipError, match="24 vertices, more than 20; cut the place out"):
        read_city_model(path)
    monkeypatch.setattr(cityjson, "MAX_BYTES", 100)
    with pytest.raises(SeipError, match="has more than"):
        read_city_model(path)


anything = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-3, 30), st.floats(), st.sampled_from(["a", "b", "2", "Solid"])),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.sampled_from("ab"), inner, max_size=2)),
    max_leaves=6,
)


@settings(max_examples=400, deadline=None)
@given(data=st.data())
def test_no_change_of_a_file_breaks_the_reader(data, tmp_path_factory):
    """One value anywhere in the file is exchanged: it is read, or refused."""
    content = json.loads(json.dumps(house().content))
    at = content
    while True:
        key = data.draw(st.sampled_from(sorted(at) if isinstance(at, dict) else range(len(at))))
        if isinstance(at[key], dict | list) and at[key] and data.draw(st.integers(0, 4)):
            at = at[key]
        else:
            at[key] = data.draw(anything)
            break
    path = tmp_path_factory.mktemp("city") / "model.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    try:
        read = read_city_model(path)
    except SeipError:
        return
    for building in read.buildings:
        solid = building_solid(read, building, "wall")
        assert solid is None or np.isfinite(solid.vertices).all()
