"""Published claims and figures of the paper.

Qu, Huang and Suo, "SEIP: Simulation-based Design and Evaluation of Infrastructure-based Collective Perception", 2023.
Its plots are pictures without values.
"""

from dataclasses import dataclass

PUBLISHED_GAINS = {"type1": ("about 20 %", "7 %"), "type2": ("10 %", "5 %")}
"""Gains of average precision from one to two and from two to four sensors (V-C); the text gives none for type 3."""
HEIGHTS = (3.5, 5.4, 8.0)  # metres, section V-A
DIFFERENCES = (
    ("Scene", "CARLA's Town05 with its buildings, trees and furniture, meshes of Unreal Engine", "{scene}"),
    ("LiDAR", "CARLA's; its types 1 to 3", "the same types; drop-off as CARLA's, beams evenly spaced"),
    (
        "Seen",
        "a return within δ of the target; δ, grid and spacing of candidates are not given",
        "the same rule; {criterion}",
    ),
    (
        "Weights",
        "central box; its weight is not given",
        "central box of the junction; weights 2, 4, 8 and 16 are tried",
    ),
    ("Solver", "Gurobi", "HiGHS or CBC, with a bound; the optimum is proven unless a row says otherwise"),
    (
        "Traffic",
        "SUMO and CARLA together; length, runs and split into training and test are not given",
        "{traffic}",
    ),
    ("Bodies", "CARLA's meshes of the models", "the models' sizes with this program's own bodies; no pedestrians"),
    (
        "Detector",
        "PointPillars of MMDetection3D; settings and training are not given",
        "PointPillars of this program, {training}",
    ),
    (
        "Truth",
        "which vehicles have to be found is not given",
        "all vehicles with their middle in the region, visible or not; rolling shutter",
    ),
    ("AP", "IoU of 0.7 from above; “%” may be points or shares; no intervals", "the same; points; 95 % intervals"),
)
"""Differences: aspect, the paper's entry, and ours, with placeholders that a run of the command fills in."""


@dataclass(frozen=True)
class PublishedClaim:
    """A claim of the paper: its number here, its place in the paper, and the claim in our words."""

    number: int
    where: str
    says: str


PUBLISHED_CLAIMS = (
    PublishedClaim(
        1, "V-A, picture of the locations", "coverage rises with N and with a better type; of type 3 hardly with N"
    ),
    PublishedClaim(2, "V-A, same picture", "four of type 3 cover 100 %; three of them stand together, fewer would do"),
    PublishedClaim(
        3, "V-A, picture of heights", "type 1 covers most from 3.5 m, types 2 and 3 from higher up, at N = 1, 2 and 4"
    ),
    PublishedClaim(
        4,
        "V-B, picture of weights",
        "weights raise the centre's coverage with four of types 1 and 2 at no cost to the whole; type 3 stays the same",
    ),
    PublishedClaim(5, "V-C, picture of accuracy", "type 1: AP + about 20 % from N = 1 to 2, + 7 % from 2 to 4"),
    PublishedClaim(6, "V-C, picture of accuracy", "type 2: AP + 10 % from N = 1 to 2, + 5 % from 2 to 4"),
    PublishedClaim(7, "abstract, V-C", "more sensors of low resolution gain more AP than more of high resolution"),
    PublishedClaim(
        8,
        "V-D, picture of errors",
        "type 1: more false positives with N = 1 and 2 than with 4, mostly in sparse places",
    ),
    PublishedClaim(
        9, "V-D", "padding of pillars with zeros makes these false positives (an explanation, not measured)"
    ),
    PublishedClaim(10, "IV", "greedy placement reaches 1 − 1/e of the optimum (cited)"),
)
