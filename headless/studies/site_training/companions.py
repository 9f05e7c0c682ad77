"""Groups of pedestrians: companions who walk or stand beside the pedestrians of a run."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

from headless.studies.random_sites.varied_bodies import draw_size

import numpy as np

from seip_addon.core.base.progress import Progress
from seip_addon.core.sensing.traffic.overlaps import find_overlaps
from seip_addon.core.sensing.traffic.trajectories import SAMPLED, RoadUser, Trajectories, some_users

IN_COMPANY = 0.4
"""Share of the pedestrians who have companions."""

MOST_COMPANIONS = 3
_BESIDE = (0.65, 0.9)  # metres between neighbours in a row, and between rows
_STREAM = 0x67726F75  # keeps these draws apart from others of the same seed


def with_companions(trajectories: Trajectories, seed: int) -> Generator[Progress, None, Trajectories]:
    """Give some pedestrians one to three companions, who keep beside or behind them.

    A companion who would overlap another road user is left out.

    Parameters
    ----------
    seed : int, 0 or above
        Seed of the groups.
    """
    random = np.random.default_rng([seed, _STREAM])
    users, firsts = list(trajectories.users), [trajectories.first[1:]]
    samples = {name: [getattr(trajectories, name)] for name in SAMPLED}
    for number, user in enumerate(trajectories.users):
        if user.category != "pedestrian" or random.random() >= IN_COMPANY:
            continue
        own = slice(int(trajectories.first[number]), int(trajectories.first[number + 1]))
        yaw = trajectories.yaw[own]
        side = random.choice((-1.0, 1.0))
        for place in range(1, int(random.integers(1, MOST_COMPANIONS + 1)) + 1):
            across = side * (place % 2) * random.uniform(*_BESIDE)
            along = -(place // 2) * random.uniform(*_BESIDE)
            position = trajectories.position[own].copy()
            position[:, 0] += along * np.cos(yaw) - across * np.sin(yaw)
            position[:, 1] += along * np.sin(yaw) + across * np.cos(yaw)
            length, width, height = draw_size("pedestrian", random)
            name, paint = f"{user.name} companion {place}", float(random.uniform(0.1, 0.8))
            users.append(RoadUser(name, user.category, length, width, height, paint))
            for key, parts in samples.items():
                parts.append(position if key == "position" else getattr(trajectories, key)[own])
            firsts.append(firsts[-1][-1:] + len(yaw))
    first = np.concatenate([[0], *firsts])
    grouped = replace(
        trajectories,
        users=tuple(users),
        first=first,
        **{name: np.concatenate(parts) for name, parts in samples.items()},
    )
    _, others = (yield from find_overlaps(grouped)).T
    kept = np.ones(len(grouped), dtype=np.bool_)
    kept[others[others >= len(trajectories)]] = False
    return some_users(grouped, kept)
