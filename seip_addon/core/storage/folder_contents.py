"""Contents of a folder of results, a placement or a run of scans: each has a folder of its own."""

from pathlib import Path

from ..base.errors import SeipError

PLACEMENT = "placement.json"
"""File of every folder that contains a placement."""

MANIFEST = "manifest.json"
"""File of every folder that contains a run of scans."""


def check_no_placement(folder: Path) -> None:
    """Raise SeipError if a folder contains a placement, whose files would be mixed with those of a run."""
    if (folder / PLACEMENT).exists():
        raise SeipError(f"{folder} contains a placement, and a run needs a folder of its own: choose another one")


def check_no_run(folder: Path) -> None:
    """Raise SeipError if a folder contains a run of scans, whose files would be mixed with those of a placement."""
    if (folder / MANIFEST).exists():
        raise SeipError(
            f"{folder} contains a run of scans, and a placement needs a folder of its own: choose another one"
        )
