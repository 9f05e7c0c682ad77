"""Options that are made from settings, and settings that are read from options."""

import argparse
import math
import re
from pathlib import Path

from headless import place
from headless.options import add_settings, new_parser, read_settings, real_number
from headless.place import add_objective, read_objective
from headless.survey import add_options

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import Limits
from seip_addon.core.base.settings import settings_of
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.scenarios.pose_errors import PoseErrors
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.survey_settings import SurveySettings

ROOT = Path(__file__).resolve().parents[2]
ALL = (CandidateSettings, VisibilitySettings, SurveySettings, Objective, Scenarios, ScanSettings)


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
        (["--spacing", "\N{ARABIC-INDIC DIGIT ONE}"], CandidateSettings, None),
        (["--allow", "islands", "assumed-poles"], CandidateSettings, {"allow": ("islands", "assumed-poles")}),
        (["--allow", "gardens"], CandidateSettings, None),
        (["--grid", "2"], SurveySettings, {"grid_spacing": 2.0}),
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
    parser = new_parser("seip place", "Place sensors.")
    add_options(parser)
    lines = parser.format_help().splitlines()
    assert lines[0] == "usage: seip place [scene] -o OUTPUT [options]"
    texts = [" ".join(line.split()) for line in lines]
    assert "-o, --output OUTPUT folder for the results" in texts
    assert "--sensor KEY ... types to choose from (default: os1_128)" in texts
    assert len(lines) <= 41


def test_weights_are_the_scene_s_or_one_for_all():
    parser = argparse.ArgumentParser()
    add_objective(parser)
    wanted = {
        (): None,
        ("--weighted",): "scene",
        ("--weighted", "3"): 3.0,
        ("--weighted", "--forbid", "x"): "scene",
    }
    for typed, weight in wanted.items():
        assert read_objective(parser.parse_args(typed)).central_weight == weight
    assert read_objective(parser.parse_args(["--require", "a", "b"])) == Objective(mandatory=("a", "b"))


@pytest.mark.parametrize(
    ("typed", "scenarios"),
    [
        ([], Scenarios()),
        (["--pose-errors"], Scenarios("pose-errors")),
        (
            ["--pose-errors", "0.1", "5", "--seed", "3"],
            Scenarios("pose-errors", PoseErrors(0.1, 0.1, math.radians(5), math.radians(5)), seed=3),
        ),
        (["--traffic", "a.npz", "--seed", "3"], Scenarios("traffic", seed=3)),
    ],
)
def test_scenarios_are_those_that_the_options_name(typed, scenarios):
    parser = argparse.ArgumentParser()
    add_objective(parser)
    assert read_objective(parser.parse_args(typed)).scenarios == scenarios


def parsed(*typed):
    parser = new_parser("try", "Try options.")
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--length", type=float)
    parser.add_argument("--many", type=int)
    parser.add_argument("--share", type=real_number(Limits(0.0, 1.0)))
    return parser.parse_args(typed)


@pytest.mark.parametrize(
    ("typed", "complaint"),
    [
        (["--length", "nan"], "--length must be a finite number, not nan"),
        (["--many", "9" * 40], "--many must be a finite number, not 999"),
        (["--share", "-0.1"], r"--share must be 0 to 1, not -0\.1"),
        ([""], "file must not be empty: name a file or folder"),
        (["a" * 5000], "file is 'aaa.*longer than a path"),
    ],
)
def test_every_option_takes_finite_numbers_and_possible_paths(typed, complaint):
    with pytest.raises(SeipError, match=complaint):
        parsed(*typed)


def test_place_has_at_most_30_options_each_with_an_example_in_its_document():
    parser = place._parser()  # noqa: SLF001  # the command's own
    options = {action.option_strings[-1] for action in parser._actions if action.option_strings} - {"--help"}  # noqa: SLF001
    assert len(options) <= 30
    text = (ROOT / "docs" / "placement.md").read_text(encoding="utf-8")
    assert [name for name in options - {"--output"} if not re.search(rf"`[^`]*{name}\b", text)] == []


@pytest.mark.parametrize(
    "typed",
    [
        ["--near", "-31.97", "115.86"],
        ["--near", "-31.97,115.86"],
        ["--near", "-31.97; 115.86"],
        ["--near", "-31.97°, 115.86°"],
    ],
)
def test_a_place_is_read_as_web_maps_copy_it(typed):
    parser = new_parser("build", "Build.")
    parser.add_argument("source")
    parser.add_argument("--near", type=float, nargs=2)
    parser.add_argument("--name")
    for args in (["map", *typed, "--name", "1,2"], [*typed, "--name", "1,2", "map"]):
        read = parser.parse_args(args)
        assert (read.near, read.name, read.source) == ([-31.97, 115.86], "1,2", "map")


@pytest.mark.parametrize("typed", [["--near", "52.5"], ["--near", "52.5,east"]])
def test_what_is_no_pair_of_numbers_is_refused(typed, capsys):
    parser = new_parser("build", "Build.")
    parser.add_argument("--near", type=float, nargs=2)
    with pytest.raises(SystemExit):
        parser.parse_args(typed)
    assert "error" in capsys.readouterr().err
