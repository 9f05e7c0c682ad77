"""Installed costs: what posts, mounting, power and backhaul add to the price of a sensor, at one place."""

from dataclasses import replace

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.deployment import pose_prices
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.site.installed_cost import load_installed_cost
from seip_addon.core.workflows.placing import optimise
from tests.builders.small_junction import Example


def counted(example, cost, bracket=0.4) -> Example:
    return replace(example, site=replace(example.site, candidates=cost.over(example.site.candidates, bracket)))


def test_each_price_is_the_sensor_and_its_place(example):
    cost = load_installed_cost()
    there = counted(example, cost)
    candidates = there.site.candidates
    on_pole = candidates.on_pole[candidates.position_of]
    added = pose_prices(candidates, example.models) - pose_prices(example.site.candidates, example.models)
    at_pole = cost.existing_pole_usd + cost.power_existing_pole_usd + cost.backhaul_usd
    at_post = cost.new_post_usd + cost.power_new_post_usd + cost.backhaul_usd
    assert set(added[on_pole]) == {at_pole}
    assert set(added[~on_pole]) == {at_post}
    arms = counted(example, cost, bracket=cost.mast_arm_beyond_m + 0.1).site.candidates
    assert set(arms.installation[arms.on_pole]) == {at_pole + cost.mast_arm_usd}
    assert set(arms.installation[~arms.on_pole]) == {at_post}


def test_a_budget_buys_less_and_moves_to_poles_that_are_there(example):
    budget = Objective(budget=30_000.0)
    bare = finish(optimise(example.site, example.visible, example.models, budget))
    there = counted(example, replace(load_installed_cost(), new_post_usd=20_000.0))
    installed = finish(optimise(there.site, example.visible, example.models, budget))
    assert installed.deployment.price <= 30_000.0
    assert len(installed.deployment.sensors) < len(bare.deployment.sensors)
    assert all(sensor.on_pole for sensor in installed.deployment.sensors)


def test_a_table_of_one_s_own_changes_what_it_names(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("new_post_usd = 9_000\n", encoding="utf-8")
    assert load_installed_cost(path) == replace(load_installed_cost(), new_post_usd=9000.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("post = 3", "mine.toml: unknown key 'post'"),
        ("backhaul_usd = -1", "backhaul_usd"),
        ('backhaul_usd = "much"', "backhaul_usd"),
        ("backhaul_usd", "not valid TOML"),
    ],
)
def test_a_mistake_has_its_sentence(tmp_path, text, says):
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SeipError, match=says):
        load_installed_cost(path)
    with pytest.raises(SeipError, match="cannot read the installed costs"):
        load_installed_cost(tmp_path / "nowhere.toml")
