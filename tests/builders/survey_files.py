"""Laser surveys written by hand: ground, blocks, crowns and traffic."""

import numpy as np

GROUND, VEGETATION, BUILDING, UNCLASSIFIED = 2, 5, 6, 1


def block_points(rng, x, y, width, depth, top, kind=BUILDING, density=8.0, low=None):
    """Points (n, 4) on the top of a block, or between two heights in it; the last column is their class."""
    count = int(width * depth * density)
    plan = rng.uniform((x, y), (x + width, y + depth), (count, 2))
    heights = np.full(count, float(top)) if low is None else rng.uniform(low, top, count)
    return np.column_stack([plan, heights, np.full(count, kind)])


def ground_points(rng, surface, reach, density=4.0, noise=0.03, without=()):
    """Points (n, 4) of the ground in a square about the middle, but under blocks (x, y, width, depth)."""
    plan = rng.uniform(-reach, reach, (int(4 * reach * reach * density), 2))
    for x, y, width, depth in without:
        inside = (plan >= (x, y)).all(axis=1) & (plan <= (x + width, y + depth)).all(axis=1)
        plan = plan[~inside]
    heights = surface(*plan.T) + rng.normal(0, noise, len(plan))
    return np.column_stack([plan, heights, np.full(len(plan), GROUND)])


def write_survey(path, points, shift=(0.0, 0.0), wkt=None):
    """Write points (n, 4) as LAS or LAZ, moved in plan."""
    import laspy  # noqa: PLC0415  # an optional extra: who asks for a survey has checked for it

    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 0.001)
    header.offsets = np.array([*np.round(shift), 0.0])
    if wkt is not None:
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points[:, 0] + shift[0], points[:, 1] + shift[1], points[:, 2]
    cloud.classification = points[:, 3].astype(np.uint8)
    cloud.write(path)
    return path
