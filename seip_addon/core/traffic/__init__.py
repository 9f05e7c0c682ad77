"""Road users: their trajectories, and their bodies as a LiDAR sees them."""

from .trajectories import CATEGORIES, RoadUser, Snapshot, Trajectories

__all__ = ["CATEGORIES", "RoadUser", "Snapshot", "Trajectories"]
