"""Outlines of triangles whose union fails on a grid."""

import numpy as np
import pytest
import shapely

from seip_addon.core.geometry import plan
from seip_addon.core.geometry.plan import outline


def test_an_outline_that_fails_on_its_grid_is_taken_on_a_finer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    square = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=np.float64)
    union = shapely.union_all

    def fails_on_a_grid(polygons: object, grid_size: float | None = None) -> object:
        if grid_size == 1e-3:
            raise shapely.errors.GEOSException("TopologyException: unable to assign free hole to a shell")
        return union(polygons, grid_size=grid_size)

    monkeypatch.setattr(plan.shapely, "union_all", fails_on_a_grid)
    assert outline(square).equals(shapely.box(0, 0, 1, 1))
