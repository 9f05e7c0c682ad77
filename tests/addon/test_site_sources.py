"""Further files of a site in the panel: the scene is that of the batch command with the same files."""

from types import SimpleNamespace

import bpy
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.site.installed_cost import load_installed_cost
from seip_addon.panels import placement
from tests.builders.dem_files import origin_at
from tests.builders.drawn_layout import DrawnLayout

X, Y, _ = origin_at(52.5, 13.4)


def test_installed_costs_are_in_the_survey(junction, tmp_path):
    survey = junction.seip.survey
    assert survey.settings().installed_cost is None
    survey.installed = True
    assert survey.settings().installed_cost == load_installed_cost()
    (tmp_path / "mine.toml").write_text("new_post_usd = 9000\n", encoding="utf-8")
    survey.installed_cost = str(tmp_path / "mine.toml")
    assert survey.settings().installed_cost == load_installed_cost(tmp_path / "mine.toml")
    layout = DrawnLayout()
    junction.seip.sections.candidates = True
    placement.draw(layout, SimpleNamespace(scene=junction, region=None))
    assert "installed_cost" in {name for name, _ in layout.properties}
    survey.installed_cost = str(tmp_path / "none.toml")
    with pytest.raises(SeipError, match="cannot read the installed costs"):
        survey.settings()
    with pytest.raises(RuntimeError, match="cannot read the installed costs"):
        bpy.ops.seip.solve_placement()
