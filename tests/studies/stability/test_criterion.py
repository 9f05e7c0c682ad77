"""The study of the criterion, on a small junction."""

from pathlib import Path
from unittest.mock import patch

from headless.studies.stability import charts
from headless.studies.stability import command as stability
from headless.studies.stability.criterion import criterion_rows, criterion_study, deviation, in_view, rotated_targets

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.scenarios import Scenarios
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
def test_lines_of_sight():
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


def test_turned_grids_cover_the_same_road():
    plain = rotated_targets(GEOMETRY, 1.0, np.zeros(2), 0.0)
    turned = rotated_targets(GEOMETRY, 1.0, np.array([0.3, 0.8]), 0.6)
    assert len(turned) == pytest.approx(GEOMETRY.region.area, rel=0.02)
    assert len(plain) == pytest.approx(GEOMETRY.region.area, rel=0.1)
    gaps = np.linalg.norm(turned.xyz[:, None, :2] - turned.xyz[None, :50, :2], axis=2)
    assert gaps[gaps > 0].min() == pytest.approx(1.0)


def test_intervals_contain_the_true_deviation():
    random = np.random.default_rng(0)
    held = 0
    for _ in range(200):
        spread = deviation(random.normal(0, 2.0, 40))
        held += spread.low <= 2.0 <= spread.high
    assert held >= 180


@pytest.mark.slow
@needs_any
def test_the_study_finds_the_border_of_the_rings(tmp_path):
    settings = SurveySettings(
        candidates=CandidateSettings(sensors=("type2",), heights=(5.4,), spacing=12.0),
        visibility=VisibilitySettings(0.5),
        grid_spacing=1.0,
        engine=ANY,
    )
    with patch.multiple(
        "headless.studies.stability.criterion",
        DELTAS=(0.5, 2.0),
        GRID_SPACINGS=(2.0, 1.0),
        CANDIDATE_SPACINGS=(16.0, 8.0),
    ):
        study = finish(criterion_study(GEOMETRY, settings, 2, draws=8))
    border = study.borders["type2"]
    assert border.radius == {5.4: unresolved_from(load_catalogue()["type2"], 5.4, 0.5, 80.0)}
    assert border.inside[0] > 0.95 * border.inside[1] > 0
    assert border.beyond[0] < 0.8 * border.beyond[1]
    fine, wide = study.by_delta["type2 at 5.4 m"]
    assert fine.coverage < wide.coverage <= wide.view <= 1
    assert fine.evaluated >= wide.evaluated
    assert len(criterion_rows(study, 0.5)) == 5
    charts.save_delta_chart(tmp_path / "delta.png", study, 0.5, "delta")
    charts.save_convergence_chart(tmp_path / "convergence.png", study, "convergence")
    for chart in tmp_path.iterdir():
        assert chart.read_bytes().startswith(b"\x89PNG")


SCENE = Path(__file__).resolve().parents[3] / "scenes" / "junction.blend"
COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--effort", "2"]
LITTLE = stability.StabilityScope(
    grids=8,
    draws=(20, 5),
    robust=Scenarios("pose-errors", count=3, held_out=20),
    traffic=Scenarios("traffic", count=2, held_out=12),
)


def test_the_page_has_all_chapters_and_charts(tmp_path):
    with patch.multiple(
        "headless.studies.stability.criterion",
        DELTAS=(4.0, 6.0),
        GRID_SPACINGS=(8.0, 6.0),
        CANDIDATE_SPACINGS=(30.0, 25.0),
        EVALUATION_SPACING=4.0,
    ):
        stability.main([str(SCENE), "-o", str(tmp_path), "--work", str(tmp_path / "work"), *COARSE], LITTLE)
    page = (tmp_path / "stability.md").read_text(encoding="utf-8")
    titles = [line[3:].partition(":")[0] for line in page.splitlines() if line.startswith("## ")]
    assert titles == ["The criterion of visibility", "Pose errors", "Failures", "Occlusion by traffic"]
    named = {part.split(")")[0] for part in page.split("](stability/")[1:]}
    assert named == {path.name for path in (tmp_path / "stability").iterdir()}
    rows = [line for line in page.splitlines() if line.startswith("| ") and "---" not in line]
    assert len(rows) == 4 + 5 + 6 + 2 + 2
    assert all(line.count(" | ") == 4 for line in rows)
