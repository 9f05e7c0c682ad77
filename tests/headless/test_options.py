"""Options that are made from settings, and settings that are read from options."""

import argparse
import math

from headless.options import add_objective, add_settings, new_parser, read_objective, read_settings
from headless.survey import add_options

import pytest

from seip_addon.core.placement.objective import Objective
from seip_addon.core.robustness.risk import Risk
from seip_addon.core.scans import ScanSettings
from seip_addon.core.settings import settings_of
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.visibility.settings import VisibilitySettings
from seip_addon.core.workflows.survey import SurveySettings
from seip_addon.core.workflows.traffic import TrafficSettings

ALL = (CandidateSettings, VisibilitySettings, SurveySettings, Objective, Risk, ScanSettings, TrafficSettings)


def surveyed(*typed):
    parser = argparse.ArgumentParser()
    add_options(parser)
    return parser.parse_args(["-o", "out", *typed])


@pytest.mark.parametrize("kind", ALL)
def test_options_left_alone_give_the_defaults(kind):
    parser = argparse.ArgumentParser()
    add_settings(parser, kind, *settings_of(kind))
    assert read_settings(kind, parser.parse_args([])) == kind()


@pytest.mark.parametrize(
    ("typed", "kind", "changed"),
    [
        (["--sensor", "type1", "vlp16"], CandidateSettings, {"sensors": ("type1", "vlp16")}),
        (["--heights", "4:5:0.5", "8"], CandidateSettings, {"heights": (4.0, 4.5, 5.0, 8.0)}),
        (["--tilts", "0", "90:1"], CandidateSettings, None),
        (["--tilts", "0", "45"], CandidateSettings, {"tilts": (0.0, math.pi / 4)}),
        (["--yaws", "12"], CandidateSettings, {"yaws": 12}),
        (["--yaws", "1.5"], CandidateSettings, None),
        (["--setback", "0.7", "--assumed-poles"], CandidateSettings, {"setback": 0.7, "assumed_poles": True}),
        (["--setback", "near"], CandidateSettings, None),
        (["--delta", "0.5"], VisibilitySettings, {"delta": 0.5}),
        (["--grid", "2", "--engine", "bvh"], SurveySettings, {"grid_spacing": 2.0, "engine": "bvh"}),
        (["--engine", "eyes"], SurveySettings, None),
    ],
)
def test_what_is_typed_reaches_its_setting_or_is_refused(typed, kind, changed):
    if changed is None:
        with pytest.raises(SystemExit):
            surveyed(*typed)
    else:
        assert read_settings(kind, surveyed(*typed)) == kind(**changed)


def test_help_has_a_line_for_each_option_and_names_its_default(monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    parser = new_parser("place", "Place sensors.")
    add_options(parser, in_full=True)
    lines = parser.format_help().splitlines()
    assert lines[0] == "usage: place [scene] -o OUTPUT [options]"
    assert "  -o, --output OUTPUT         folder for the results" in lines
    assert "  --sensor KEY ...            types to choose from (default: type1 type2 type3)" in lines
    (assumed,) = (line for line in lines if "--assumed-poles" in line)
    assert "default" not in assumed
    assert len(lines) <= 40


def test_help_names_the_options_of_a_survey_where_another_command_explains_them(monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    parser = new_parser("robust", "Place sensors.")
    add_options(parser)
    text = parser.format_help()
    assert "--heights --tilts --yaws --assumed-poles --installed-cost (see: seip place --help)\n" in text
    assert "types to choose from" not in text


def test_weights_are_the_scene_s_or_one_for_all():
    parser = argparse.ArgumentParser()
    add_objective(parser)
    wanted = {
        (): None,
        ("--weighted",): "scene",
        ("--central-weight", "3"): 3.0,
        ("--weighted", "--forbid", "x"): "scene",
    }
    for typed, weight in wanted.items():
        assert read_objective(parser.parse_args(typed)).central_weight == weight
    assert read_objective(parser.parse_args(["--require", "a", "b"])) == Objective(mandatory=("a", "b"))
