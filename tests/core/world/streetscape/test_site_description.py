import math
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.streetscape.site_file import read_site_description

FULL = """
name = "Crossing"
map = "maps/crossing.xodr"
near = [10, -20.5]
radius = 60

[[weighted_region]]
junction = "7"
weight = 3

[[weighted_region]]
name = "Box"
polygon = [[0, 0], [4, 0], [4, 4]]

[[building]]
outline = [[0, 0], [10, 0], [10, 5], [0, 5]]
height = 12

[[tree]]
from = [0, 0]
to = [0, 20]
spacing = 9
height = 10

[[wall]]
line = [[0, 0], [5, 0]]

[[street_light]]
position = [1, 2]
heading = 90

[[signal_pole]]
position = [3, 4]

[[forbidden_area]]
name = "Church"
polygon = [[0, 0], [1, 0], [1, 1]]

[[mandatory_area]]
polygon = [[0, 0], [1, 0], [1, 1]]
"""


def read(folder: Path, text: str):
    path = folder / "site.toml"
    path.write_text(text, encoding="utf-8")
    return read_site_description(path)


def test_every_key_arrives(tmp_path):
    site = read(tmp_path, FULL)
    assert (site.name, site.map, site.near, site.radius) == (
        "Crossing",
        tmp_path / "maps/crossing.xodr",
        (10.0, -20.5),
        60.0,
    )
    assert [(w.name, w.weight, w.junction) for w in site.weighted_regions] == [
        ("Junction 7", 3.0, "7"),
        ("Box", 2.0, None),
    ]
    assert site.weighted_regions[1].polygon.area == 8.0
    assert (site.buildings[0].outline.area, site.buildings[0].height, site.buildings[0].base) == (50.0, 12.0, 0.0)
    np.testing.assert_allclose(site.trees[0].positions, [[0, 0], [0, 9], [0, 18]])
    assert (site.trees[0].height, site.trees[0].crown_diameter) == (10.0, 6.0)
    assert (site.walls[0].height, site.walls[0].thickness) == (2.0, 0.25)
    assert math.isclose(site.street_lights[0].heading, math.pi / 2)
    assert (site.signal_poles[0].height, site.signal_poles[0].arm, site.signal_poles[0].heading) == (6.0, 5.0, None)
    assert (site.forbidden_areas[0].name, site.mandatory_areas[0].name) == ("Church", "Area")


def test_a_row_ends_on_its_last_whole_step_in_spite_of_rounding(tmp_path):
    row = read(tmp_path, "[[tree]]\nfrom = [0, 0]\nto = [0.9, 0]\nspacing = 0.3\n").trees[0]
    np.testing.assert_allclose(row.positions[:, 0], [0, 0.3, 0.6, 0.9], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("radious = 3", "unknown key 'radious'; did you mean radius"),
        ("[[building]]\noutline = [[0, 0], [1, 0], [1, 1]]\nheigth = 3", "building 1: height is missing"),
        ("[[building]]\noutline = [[0, 0], [1, 0], [1, 1]]\nheight = 3\nhight = 4", "did you mean height"),
        ("radius = -1", "radius must be 0.1 to 5,000 m, not -1"),
        ("radius = nan", "radius must be a number"),
        ("radius = true", "radius must be a number"),
        ('radius = "80"', "radius must be a number"),
        ("near = [1]", r"near must be a point \[x, y\]"),
        ("near = [1, inf]", "near must be a point"),
        ("name = 3", "name must be a text"),
        ('near = [0, 0]\njunction = "1"', "either near or junction"),
        ("region = [[0, 0], [1, 1]]", "region must be a list of at least three points"),
        ("region = [[0, 0], [2, 2], [2, 0], [0, 2]]", "does not cross itself"),
        ("region = [[0, 0], [1, 1], [2, 2]]", "region must be"),
        ("region = []", "region must be a list"),
        ("[[tree]]\nposition = [0, 0]\nheight = 0", "tree 1: height must be 0.01 to"),
        ("[[tree]]\nposition = [0, 0]\nheight = 1e-300", "tree 1: height must be 0.01 to 1,000 m, not 1e-300"),
        ("[[wall]]\nline = [[0, 0], [1, 0]]\nthickness = 1e-300", "thickness must be 0.001 to 100,000 m"),
        ("[[tree]]\nposition = [0, 0]\ncrown_diameter = inf", "crown_diameter must be a number from 0.001"),
        ('[[weighted_region]]\njunction = "1"\nweight = 1e300', "weight must be"),
        ("region = [[0, 0], [1e-9, 0], [0, 1e-9]]", "no area"),
        ("[[tree]]\nheight = 3", "either position"),
        ("[[tree]]\nfrom = [0, 0]\nto = [1, 0]", "a row with from, to and spacing"),
        ("[[tree]]\nposition = [0, 0]\nspacing = 3", "either position"),
        ("[[wall]]\nline = [[0, 0]]", "at least two points"),
        ("[[street_light]]\nposition = [0, 0]\narm = -1", "arm must be 0 to"),
        ('[[weighted_region]]\nname = "x"', "either polygon or junction"),
        ("[building]\nheight = 3", r"begins with \[\[building\]\]"),
        ("name = ", "is not valid TOML"),
    ],
)
def test_a_mistake_is_named_with_its_cure(tmp_path, text, complaint):
    with pytest.raises(SeipError, match=complaint) as raised:
        read(tmp_path, text)
    assert "site.toml" in str(raised.value)
    assert "\n" not in str(raised.value).strip()
