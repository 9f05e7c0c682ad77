"""Parts of a modelled site."""

from dataclasses import dataclass

from ...geometry.solids import Solid
from ...site.post_rules import RuleName
from ...site.roles import Role


@dataclass(frozen=True, eq=False)
class Part:
    """One object of the scene.

    Parameters
    ----------
    solid : Solid
        Shape; parts may share one.
    foot : (3,) float64, metres
        Position of the shape's origin, local axes.
    yaw : float, radians
        Rotation of the shape about the vertical, counter-clockwise.
    weight : float or None
        Weight of a weighted region.
    source : str
        Source of the part, as in `scene_geometry.Pole`; empty for parts that only mark an area.
    height_assumed : bool
        Whether the source lacks its height.
    width_assumed : bool
        Whether the source lacks its width, as for lanes.
    keep_off : str or None
        Rule that excludes new posts from the part, or sensors from the pole, unless it is allowed.
    of : str
        Name of an earlier part that this one follows if it is moved or deleted; "" if there is none.
    """

    name: str
    solid: Solid
    roles: tuple[Role, ...]
    foot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    weight: float | None = None
    source: str = ""
    height_assumed: bool = False
    width_assumed: bool = False
    keep_off: RuleName | None = None
    of: str = ""
