"""Measurements of a sensor that follows a law, as `seip study calibration` reads them."""

import itertools

import numpy as np
from scipy.stats import norm

from seip_addon.core.sensing.lidar.range_equation import RangeEquation

LAW = RangeEquation(-11.6, 0.7, 0.96)
HEIGHT = 3.0
EDGES = (0, 10, 20, 30, 40, 50, 60, 80, 100)
ELEVATIONS = np.linspace(-25.0, 5.0, 61)
OFFSETS = np.tile([-4.0, -1.0, 1.0, 4.0, 0.0], 13)[:61]


def share(low, high, law, reflectivity, cos=None):
    """Return the mean of the formula over a bin, by another library and a finer sum."""
    distance = np.linspace(low + 1e-6, high, 4001)
    towards = np.minimum(HEIGHT / distance, 1.0) if cos is None else cos
    return float(
        law.ceiling * norm.cdf((np.log(reflectivity * towards / distance**2) - law.threshold) / law.spread).mean()
    )


def measured(law):
    """Return the content of a file about a sensor that follows a law."""

    def bins(reflectivity, cos):
        return [
            {
                "bin": f"{low}-{high}",
                "rays": 1000,
                "share": share(low, high, law, reflectivity, cos),
                "mean_cos_incidence": cos or min(1.0, 2 * HEIGHT / (low + high)),
                "sector_bootstrap95": [0.0, 1.0],
            }
            for low, high in itertools.pairwise(EDGES)
        ]

    sensor = {
        "identity": {"sensor": "Test 61", "mounting_height_m": HEIGHT},
        "ground_by_range_m": bins(0.17, None),
        "vertical_by_range_m": bins(0.3, 0.8),
        "range_noise_ground": [{"bin": "10-20", "robust_std_m": 0.01}, {"bin": ">100", "robust_std_m": 1.0}],
        "range_noise_vertical": [],
        "fate_correlation_along_ring_20_to_100_m": {"1": 0.6, "5": 0.2},
        "beams": {
            "elevation_deg": ELEVATIONS.tolist(),
            "azimuth_offset_deg": OFFSETS.tolist(),
            "azimuth_step_deg": 0.5,
        },
        "ground_by_range_m_over_20_sweeps": [{"bin": "60-80", "intraclass_correlation": 0.8}],
    }
    return {"version": 1, "sensors": {"mine": sensor}}
