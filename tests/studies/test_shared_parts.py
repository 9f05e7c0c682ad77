"""Verdicts at their edges."""

from headless.options import read_settings
from headless.studies.claims import verdict_above, verdict_within, worst_verdict
from headless.studies.rank_correlation import rank_correlation
from headless.studies.survey_options import study_parser

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.site.candidates import PAPER_TYPES, CandidateSettings


def test_verdicts():
    assert verdict_above((0.01, 0.2)) == "holds"
    assert verdict_above((-0.2, 0.0)) == "does not hold"
    assert verdict_above((-0.01, 0.2)) == "undecided"
    assert verdict_above((0.4, 0.6), 0.5) == "undecided"
    assert verdict_within((0.1, 0.2), 0.1, 0.4) == "holds"
    assert verdict_within((0.05, 0.2), 0.1, 0.4) == "undecided"
    assert verdict_within((0.0, 0.09), 0.1, 0.4) == "does not hold"
    assert verdict_within((0.41, 0.5), 0.1, 0.4) == "does not hold"
    assert verdict_within((0.0, 0.9), 0.1, 0.4) == "undecided"
    assert worst_verdict(["holds", "undecided", "holds"]) == "undecided"
    assert worst_verdict(["undecided", "does not hold"]) == "does not hold"
    assert worst_verdict(["holds"]) == "holds"


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=20))
def test_rank_correlation(pairs):
    x, y = np.array(pairs, dtype=float).T
    if len(set(x)) == 1 or len(set(y)) == 1:
        assert np.isnan(rank_correlation(x, y))
    else:
        assert rank_correlation(x, y) == pytest.approx(scipy.stats.spearmanr(x, y).statistic, abs=1e-12)


def test_studies_start_from_the_types_of_the_paper():
    parser = study_parser("coverage", "Study coverage.")
    assert read_settings(CandidateSettings, parser.parse_args(["-o", "out"])).sensors == PAPER_TYPES
    assert read_settings(CandidateSettings, parser.parse_args(["-o", "out", "--sensor", "vlp16"])).sensors == ("vlp16",)
