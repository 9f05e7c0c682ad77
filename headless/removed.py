"""Options and values of options that earlier versions had, with what replaces each."""

from collections.abc import Sequence

from seip_addon.core.base.errors import SeipError

_CONSTANT = "the value that it had by default is used; from Python, set it in the settings of a survey"
_ERRORS = "give the standard deviations in metres and degrees as --pose-errors 0.3 2"
_IMPORT = "import the file in Blender, and link its objects to the collection SEIP Occluders (docs/sources.md)"

REMOVED: dict[str, str] = {
    "--assumed-poles": "use --allow assumed-poles",
    "--bracket": _CONSTANT,
    "--central-weight": "use --weighted W",
    "--clearance": _CONSTANT,
    "--criterion height": "use --criterion road or returns",
    "--delta": _CONSTANT,
    "--detection": _CONSTANT,
    "--engine": "Embree is used where it is installed, otherwise BVHTree",
    "--flows": "write the vehicles per hour of each site into the column weight of a table of sites",
    "--height-error": _ERRORS,
    "--held-out": _CONSTANT,
    "--installed": "give the whole budget at once",
    "--keep-sensors": "use --require without names",
    "--memory": "each process may use 4 GiB; use fewer --workers where the machine has less",
    "--min-intensity": _CONSTANT,
    "--minimum": "use --coverage for a share of the road at every site",
    "--position-error": _ERRORS,
    "--reflectivity": "set the property seip_reflectivity of the material in the scene",
    "--scenarios": _CONSTANT,
    "--scheduler": "visibility takes seconds; `seip network --scheduler` shares many sites among machines",
    "--seen-by": "the result has the share of the road seen twice; --failures worst asks for redundancy",
    "--sensors-only": "give --installed-cost a TOML file whose costs are 0",
    "--setback": _CONSTANT,
    "--tilt-error": _ERRORS,
    "--time-limit": "use --effort, about a second of one core for each unit",
    **dict.fromkeys(("--placement", "--only-placement"), "use `seip detect` on the scene with the placed sensors"),
    "--placements": "the open benchmark compares placements (docs/open-benchmark.md)",
    "--other": "docs/detector-limits.md has its figures",
    "--tolerance": "give --grid and --spacing; docs/stability.md shows what coarser ones lose",
    "--weights-from-traffic": "give regions a weight in the scene and add --weighted",
    "--yaw-error": _ERRORS,
    "--yaws": _CONSTANT,
    **dict.fromkeys(("--buildings", "--buildings-epsg", "--buildings-origin"), _IMPORT),
    **dict.fromkeys(("--mesh", "--mesh-origin", "--mesh-up"), _IMPORT),
    **dict.fromkeys(
        ("--head", "--pillar", "--points", "--width", "--blocks", "--batch", "--threads"),
        "`seip train` trains the network of the shipped detector",
    ),
    "--no-noise": "noise is part of a sensor's model; from Python, set it in the settings of a scan",
    **dict.fromkeys(("--rolling-shutter", "--no-rolling-shutter"), "traffic always moves while sensors turn"),
    "--score": "detections.csv and the pictures show those with a confidence of 0.5 or more, kitti/ has all",
    "--begin": "use --start",
    "--end": "use --duration",
    **dict.fromkeys(("--turns", "--green"), "all simulations have the same shares of turns and the same signal plan"),
    "--format opv2v": "use openpcdet, mmdetection3d, kitti or pcd",
    "--format las": "use pcd, and convert its files with PDAL or CloudCompare",
}
"""Advice by option, or by option and value as in ``--format opv2v``, as the end of a sentence."""


def check_removed(arguments: Sequence[str], options: Sequence[str]) -> None:
    """Check that no argument is an option that an earlier version had.

    Parameters
    ----------
    arguments : sequence of str
        Command line, without the program.
    options : sequence of str
        Options of the command; these are never refused.

    Raises
    ------
    SeipError
        An option, or a value of one, is gone. The message says what replaces it.

    Examples
    --------
    >>> check_removed(["site.blend", "--count", "4"], ["--count"])
    """
    option = ""
    for argument in arguments:
        name, _, value = argument.partition("=")
        if name.startswith("--"):
            option = name
        given = f"{option} {value or argument}"
        gone = option if option not in options and option in REMOVED else given if given in REMOVED else None
        if gone is not None:
            raise SeipError(f"{gone} is no longer an option: {REMOVED[gone]}")
