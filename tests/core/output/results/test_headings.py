import math

from seip_addon.core.geometry.orientation import degrees


def test_counter_clockwise_from_zero_to_below_a_full_turn():
    assert degrees(-math.pi / 2) == 270.0
    assert degrees(2 * math.pi - 1e-12) == 0.0
    assert degrees(-1e-12) == 0.0
