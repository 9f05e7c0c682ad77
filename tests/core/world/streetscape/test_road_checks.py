"""Warnings of carriageways that no vehicle could climb, and of steps between lanes that lead into each other."""

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section


def rising(grade, z=0.0):
    return f'<elevation s="0" a="{z}" b="{grade}" c="0" d="0"/>'


def two_roads(grade=0.0, step=0.0, *, turned=False):
    """Return a street of two roads that lead into each other at (0, 0); the second may be laid the other way."""
    lanes = section(lane(1), lane(-1))
    first = road(geometry(length=60.0, x=-60.0), lanes, number="1", elevation=rising(grade))
    start = {"x": 60.0, "hdg": np.pi} if turned else {"x": 0.0, "hdg": 0.0}
    second = road(geometry(length=60.0, **start), lanes, number="2", elevation=rising(0.0, 60 * grade + step))
    contact = "end" if turned else "start"
    link = f'<link><successor elementType="road" elementId="2" contactPoint="{contact}"/></link>'
    return document(first.replace("<planView>", f"{link}<planView>", 1), second)


def warnings(tmp_path, text):
    model = finish(site_model(read_text(tmp_path, text), SiteDescription(near=(0.0, 0.0), radius=50.0)))
    return list(model.warnings)


@pytest.mark.parametrize(("grade", "steep"), [(0.0, False), (-0.12, False), (0.125, True), (0.2, True), (-1.4, True)])
def test_a_carriageway_steeper_than_any_street_is_named(tmp_path, grade, steep):
    found = warnings(tmp_path, two_roads(grade))
    assert bool(found) == steep
    if steep:
        assert found[0].startswith(f"carriageways are steeper than 12%: up to {abs(grade):.1%} on road 1 at (-")


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("step", "warned"), [(0.0, False), (0.05, False), (0.4, True), (-6.0, True)])
def test_a_step_between_roads_that_lead_into_each_other_is_named(tmp_path, step, warned, turned):
    found = warnings(tmp_path, two_roads(0.0, step, turned=turned))
    assert bool(found) == warned
    if warned:
        assert f"differ in height by {abs(step):.2f} m on road 1 at (0, 2)" in found[0]
