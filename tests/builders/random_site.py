"""Random placement problems of sites, small enough for enumeration."""

import numpy as np

from seip_addon.core.choosing.network.site_problem import SiteProblem


def random_problem(seed, criterion, most=3):
    """Return a problem of nine poses at six positions at most."""
    rng = np.random.default_rng(seed)
    poses, targets, users = 9, 40, 30 if criterion == "returns" else 0
    returns = rng.gamma(0.5, 10.0, (poses, users)) * (rng.random((poses, users)) < 0.4)
    return SiteProblem(
        criterion=criterion,
        visible=rng.random((poses, targets)) < 0.3,
        returns=returns.astype(np.float32),
        user_weights=rng.random(users) + 0.1,
        prices=rng.choice([14_000.0, 20_000.0], size=poses),
        positions=rng.integers(0, 6, size=poses),
        xyz=rng.normal(0.0, 30.0, (poses, 3)),
        heights=np.full(poses, 5.4),
        latlon=np.tile((54.3, 7.4), (poses, 1)),
        labels=np.array(["os1_128"] * poses),
        names=np.array([f"sidewalk {number}" for number in range(poses)]),
        most_sensors=most,
    )
