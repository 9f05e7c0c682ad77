import numpy as np

from seip_addon.core.site.site import Targets
from seip_addon.core.site.target_squares import target_squares


def targets(xyz, spacing):
    count = len(xyz)
    return Targets(np.array(xyz, dtype=float), np.ones(count), np.zeros(count, bool), spacing)


def test_corners_that_squares_share_have_the_mean_height():
    left, right = target_squares(targets([(0.5, 0.5, 1.0), (1.5, 0.5, 3.0)], 1.0))
    assert left[:, 2].tolist() == [1.0, 2.0, 2.0, 1.0]
    assert right[:, 2].tolist() == [2.0, 3.0, 3.0, 2.0]
    assert np.array_equal(left[[1, 2]], right[[0, 3]])
