"""Options of a survey, as the commands of studies have them."""

import argparse

from headless.options import new_parser, read_settings
from headless.studies.survey_options import add_survey_options

from seip_addon.core.site.candidates import PAPER_TYPES, CandidateSettings


def test_studies_start_from_the_types_of_the_paper():
    parser = argparse.ArgumentParser()
    add_survey_options(parser)
    assert read_settings(CandidateSettings, parser.parse_args(["-o", "out"])).sensors == PAPER_TYPES
    assert read_settings(CandidateSettings, parser.parse_args(["-o", "out", "--sensor", "vlp16"])).sensors == ("vlp16",)


def test_help_names_the_options_of_a_survey_where_another_command_explains_them(monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    parser = new_parser("study coverage", "Study coverage.")
    add_survey_options(parser)
    text = parser.format_help()
    assert "--heights --tilts --installed-cost (see: seip place --help)\n" in text
    assert "types to choose from" not in text
