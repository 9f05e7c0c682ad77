"""The lazy grid is the full scan's on real scenes, whatever δ."""

from __future__ import annotations

from pathlib import Path

from headless import runtime
from headless.studies.benchmark.visibility import visibility_costs

import bpy
import pytest

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.site import Site, make_site
from seip_addon.scene.read import read_scene

pytest.importorskip("embreex", reason="embreex is not installed")
pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[3]


def site_of(scene: Path, grid: float = 1.0) -> Site:
    runtime.open_scene(scene)
    return make_site(read_scene(bpy.context.scene).geometry, CandidateSettings(), grid)


def lazy_is_full(site: Site, settings: VisibilitySettings, samples: int) -> None:
    """Compare at positions spread over the site, with both engines; lazy runs must cast few rays as well."""
    costs = visibility_costs(site, load_catalogue(), settings, samples)
    for engine in ("bvh", "embree"):
        full, lazy = costs[f"full {engine}"], costs[f"lazy {engine}"]
        assert lazy.seen == full.seen > 0
        assert lazy.rays < 0.05 * full.rays


@pytest.mark.parametrize(
    "settings",
    [VisibilitySettings(0.3), VisibilitySettings(1.0, 0.1)],
)
def test_on_the_shipped_junction(settings: VisibilitySettings) -> None:
    lazy_is_full(site_of(ROOT / "scenes" / "junction.blend"), settings, samples=6)
