"""What the study of detection says of its trainings."""

from headless.detection.training import LearningCurve
from headless.studies.detection.case_study import still_rises


def test_validation_still_rises_where_its_last_value_is_the_best_by_far():
    def rises(*values):
        return still_rises(LearningCurve([], {300 * (number + 1): value for number, value in enumerate(values)}))

    assert rises(0.002)  # one value says nothing
    assert rises(0.3, 0.5, 0.6)
    assert not rises(0.3, 0.5, 0.51)
    assert not rises(0.3, 0.7, 0.5, 0.6)  # it has been better before
