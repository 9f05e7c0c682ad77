"""Road users, where they are at any time, and what they look like to a LiDAR."""

from .trajectories import CATEGORIES, RoadUser, Snapshot, Trajectories

__all__ = ["CATEGORIES", "RoadUser", "Snapshot", "Trajectories"]
