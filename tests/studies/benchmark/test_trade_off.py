"""Errors of simplified grids on a scene whose shadows are worked out by hand, and the chart of time against error."""

from headless.studies.benchmark.charts import Method, pareto_front, trade_off
from headless.studies.benchmark.simplifications import (
    degradations,
    every_nth_azimuth,
    every_other_channel,
    simplifications,
)

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.site.site import make_site
from tests.builders.plain_street import block, sheet
from tests.builders.traffic_by_hand import make_model

DENSE = make_model(elevations=np.radians(np.arange(-80.0, -20.0, 0.25)), points_per_second=240 * 3600 * 10.0)
"""Its rays meet the road less than 0.2 m apart in the whole scene, even with half the channels or azimuth steps."""


def street_with_wall_and_gantry():
    """A road of 8 × 4 m, and four poles 1 m before its end whose sensors at 4 m look along it.

    The wall's back edge, at x = 2.2 and z = 1.774, has its shadow end at x = -1 + 3.2 · 4 / (4 - 1.774) = 4.75. The
    gantry has its legs beside all lines of sight and its beam above them; its bounding box closes the road.
    """
    wall = Mesh("wall", block((2.1, -3, 0), (2.2, 7, 1.774)))
    legs_and_beam = [((5.15, -3, 0), (5.2, -2.9, 9)), ((5.15, 6.9, 0), (5.2, 7, 9)), ((5.15, -3, 8), (5.2, 7, 9))]
    gantry = Mesh("gantry", np.concatenate([block(*corners) for corners in legs_and_beam]))
    return SceneGeometry(
        name="street",
        origin=np.zeros(3),
        roads=(Mesh("road", sheet(0, 0, 8, 4)),),
        ground=(),
        occluders=(wall, gantry),
        region=shapely.box(0, 0, 8, 4),
        poles=tuple(Pole(f"pole {y}", np.array([-1.0, y, 0.0])) for y in (0.5, 1.5, 2.5, 3.5)),
    )


@pytest.fixture(scope="module")
def errors():
    geometry, models = street_with_wall_and_gantry(), {"test": DENSE}
    layout = CandidateSettings(sensors=("test",), heights=(4.0,), bracket=0.0)
    site = make_site(geometry, layout)
    simpler = simplifications(geometry, site, models, layout)
    return degradations(site, models, VisibilitySettings(0.2), simpler, 5.0)


# Of eight columns of four targets, at x = 0.5 … 7.5, the exact grid has the five that are not in the wall's shadow.
@pytest.mark.parametrize(
    ("name", "wrong_columns", "claimed"),
    [
        ("none", 0, 5 / 8),
        ("azimuth ÷ 2", 0, 5 / 8),
        ("channels ÷ 2", 0, 5 / 8),
        ("grid of 2 m", 1, 3 / 4),  # columns at 1, 3, 5 and 7: that at 5 is lit and stands for the one at 4.5 as well
        ("grid of 4 m", 3, 1.0),  # columns at 2, before the wall, and at 6: both are lit
        ("objects as boxes", 3, 2 / 8),  # the gantry's box hides those at 5.5, 6.5 and 7.5
    ],
)
def test_errors_of_simplified_grids_are_those_worked_out_by_hand(errors, name, wrong_columns, claimed):
    own = errors[name]
    assert own.wrong == pytest.approx(wrong_columns / 5)
    assert own.claimed == pytest.approx(claimed)
    assert own.coverage == pytest.approx(5 / 8)  # all four poles see the same, whichever grid they are chosen on
    assert own.proven


def test_simplified_sensors_have_fewer_rays_at_the_same_rate():
    wide, half = every_nth_azimuth(DENSE, 8), every_other_channel(DENSE)
    assert (wide.channels, wide.azimuth_count) == (240, 450)
    assert (half.channels, half.azimuth_count) == (120, 3600)
    assert half.elevations.tolist() == DENSE.elevations[[*range(0, 240, 2)]].tolist()


METHODS = st.lists(
    st.tuples(st.integers(1, 9), st.integers(0, 9)).map(lambda at: Method("", "", float(at[0]), float(at[1]))),
    min_size=1,
)


def dominates(a, b):
    return a.seconds <= b.seconds and a.error <= b.error and (a.seconds, a.error) != (b.seconds, b.error)


@given(METHODS)
def test_pareto_front_has_the_methods_that_none_dominates(methods):
    front = {(one.seconds, one.error) for one in pareto_front(methods)}
    assert front == {(a.seconds, a.error) for a in methods if not any(dominates(b, a) for b in methods)}


def test_chart_names_every_method_and_rings_the_default():
    methods = [Method("slow", "exact", 20.0, 0.0), Method("lazy", "exact", 0.2, 0.0, default=True)]
    methods.append(Method("coarse", "simplified", 0.1, 0.3))
    figure = trade_off({"wrong pairs": methods}, "time against error")
    (panel,) = figure.axes
    assert {text.get_text() for text in panel.texts} == {"slow", "lazy", "coarse"}
    ring = next(line for line in panel.lines if line.get_label() == "default: lazy")
    assert (*ring.get_xdata(), *ring.get_ydata()) == (0.0, 0.2)
    front = next(line for line in panel.lines if line.get_label() == "Pareto front")
    assert front.get_xydata().tolist() == [[0.3, 0.1], [0.0, 0.2]]
    assert "default: lazy" in {text.get_text() for legend in figure.legends for text in legend.get_texts()}
