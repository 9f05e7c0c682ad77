"""The study of the criterion, on a small junction."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

from headless.studies.stability import charts
from headless.studies.stability.criterion import (
    Draws,
    criterion_rows,
    criterion_study,
    in_view,
    ring_borders,
    rotated_targets,
)

import numpy as np
import pytest

from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.ring_resolution import unresolved_from
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.small_junction import make_geometry
from tests.builders.synthetic_junction import rectangle
from tests.engines import ANY, needs_any

GEOMETRY = make_geometry(24.0)


@needs_any
def test_lines_of_sight() -> None:
    road = rectangle((-50, -5), (50, 5), step=10.0)
    wall = np.array([[[10.0, -5, 0], [10, 5, 0], [10, 5, 20]], [[10, -5, 0], [10, 5, 20], [10, -5, 20]]])
    model = load_catalogue()["type3"]
    targets = np.array([[5.0, 0, 0], [20, 0, 0], [-20, 0, 0], [0.01, 0, 0], [-400, 0, 0]])
    caster = make_ray_caster(np.concatenate([road, wall]), ANY)
    assert in_view(caster, model, np.array([0.0, 0, 5]), np.eye(3), targets[2:3]).all()
    seen = in_view(caster, model, np.array([0.0, 0, 5]), np.eye(3), targets)
    assert not seen[1]  # behind the wall
    assert not seen[3]  # below the lowest channel
    assert not seen[4]  # out of range


def test_borders_are_those_of_the_warning() -> None:
    models = {"type1": load_catalogue()["type1"]}
    for border in ring_borders(models, (3.5, 8.0), (0.5, 1.0), 80.0):
        assert border.radius == unresolved_from(models["type1"], border.height, border.delta, 80.0)


def test_turned_grids_cover_the_same_road() -> None:
    plain = rotated_targets(GEOMETRY, 1.0, np.zeros(2), 0.0)
    turned = rotated_targets(GEOMETRY, 1.0, np.array([0.3, 0.8]), 0.6)
    assert len(turned) == pytest.approx(GEOMETRY.region.area, rel=0.02)
    assert len(plain) == pytest.approx(GEOMETRY.region.area, rel=0.1)
    gaps = np.linalg.norm(turned.xyz[:, None, :2] - turned.xyz[None, :50, :2], axis=2)
    assert gaps[gaps > 0].min() == pytest.approx(1.0)


def test_spreads_hold_the_true_one() -> None:
    random = np.random.default_rng(0)
    held = 0
    for _ in range(200):
        low, high = Draws("", random.normal(0, 2.0, 40)).spread_interval
        held += low <= 2.0 <= high
    assert held >= 180


@pytest.mark.slow
@needs_any
def test_the_study_finds_the_border_of_the_rings(tmp_path: Path) -> None:
    settings = SurveySettings(
        candidates=CandidateSettings(sensors=("type2",), heights=(5.4,), spacing=12.0),
        visibility=VisibilitySettings(0.5),
        grid_spacing=1.0,
        engine=ANY,
    )
    with (
        patch("headless.studies.stability.criterion.DELTAS", (0.5, 2.0)),
        patch("headless.studies.stability.criterion.GRID_SPACINGS", (2.0, 1.0)),
        patch("headless.studies.stability.criterion.CANDIDATE_SPACINGS", (16.0, 8.0)),
    ):
        study = finish(criterion_study(GEOMETRY, settings, 2, draws=8))
    (by_ratio,) = study.by_ratio
    inside = [s.value for edge, s in zip(by_ratio.ratios, by_ratio.seen, strict=False) if s and 0.25 <= edge < 1]
    beyond = [s.value for edge, s in zip(by_ratio.ratios, by_ratio.seen, strict=False) if s and edge >= 1.5]
    assert min(inside) > 0.95
    assert max(beyond) < 0.8
    fine, wide = study.by_delta
    assert fine.coverage < wide.coverage <= 1
    assert fine.moved == 0
    assert study.azimuth.spread < 0.02
    assert len(criterion_rows(study, 0.5)) == 7
    for number, draw in enumerate(
        (
            lambda path: charts.save_ring_border_chart(path, study, 0.5, "rings"),
            lambda path: charts.save_border_check_chart(path, study, "border"),
            lambda path: charts.save_delta_chart(path, study, 0.5, "delta"),
            lambda path: charts.save_convergence_chart(path, study, "convergence"),
        )
    ):
        draw(tmp_path / f"{number}.png")
        assert (tmp_path / f"{number}.png").read_bytes().startswith(b"\x89PNG")
