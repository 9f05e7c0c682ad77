"""The parts that a modelled site is made of."""

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
        Its shape; parts may share one.
    foot : (3,) float64, metres
        Where the shape's origin stands, local axes.
    yaw : float, radians
        How the shape is turned about the vertical, counter-clockwise.
    weight : float or None
        Of a weighted region.
    source : str
        Who says that it stands there, as in `scene_geometry.Pole`; empty for what only means an area.
    height_assumed : bool
        Whether that source does not give its height.
    width_assumed : bool
        Whether that source does not give its width, as of lanes.
    keep_off : str or None
        Rule that keeps new posts off the part, or sensors off the pole, unless it is allowed.
    of : str
        Name of the part, an earlier one, that takes this along where it is moved or deleted; empty where none does.
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
