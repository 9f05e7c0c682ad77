"""Options of a survey, as the commands of studies have them."""

from headless.options import read_settings
from headless.studies.survey_options import study_parser

from seip_addon.core.site.candidates import PAPER_TYPES, CandidateSettings


def test_studies_start_from_the_types_of_the_paper():
    parser = study_parser("coverage", "Study coverage.")
    assert read_settings(CandidateSettings, parser.parse_args(["-o", "out"])).sensors == PAPER_TYPES
    assert read_settings(CandidateSettings, parser.parse_args(["-o", "out", "--sensor", "vlp16"])).sensors == ("vlp16",)
