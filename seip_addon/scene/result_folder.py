"""The folder of results: tables, pictures, and the scene with its sensors."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.deployment import Deployment
from ..core.choosing.placement.objective import Solution, placement_constraints
from ..core.output.pictures.drawing import save_png
from ..core.output.pictures.labelled_view import save_labelled_view
from ..core.output.pictures.palette import packed_counts
from ..core.output.pictures.plan_view import draw_plan
from ..core.output.results.file_names import REPORT_FILES
from ..core.output.results.geographic_files import LOCATED_FILES, located, save_geojson, save_kml
from ..core.output.results.placement_record import PlacementRecord, save_placement
from ..core.output.results.site_file import save_site_file
from ..core.site.site import Site
from ..core.storage.files import digest, unfinished_name
from ..core.workflows.survey import Survey
from . import contract
from .blend_file import save_blend, save_glb
from .pieces import tidy_pieces
from .render import render_elsewhere
from .write import shown_legend, write_result

FILES = (
    *("site.npz", "plan.png", "view.png"),
    *("scene.glb", "placed.blend", "placement.json"),
)
"""In the order in which they take their places: where ``placement.json`` stands, everything else does."""
ATTRIBUTION_FILE = "ATTRIBUTION.txt"
"""Credits for the files whose formats have no place for them, such as CSV tables."""
MAY_BE_MISSING = (ATTRIBUTION_FILE, *LOCATED_FILES, *REPORT_FILES)
"""Files of sites whose sources demand credits, and of where the map's projection is known; and reports, which are
written later: those on an earlier result go."""


@contextmanager
def result_files(folder: Path) -> Iterator[dict[str, Path]]:
    """Yield temporary names for the files of a result, which take the place of an earlier result's at the end.

    An earlier result stays whole until everything is written, and stays for good if the block raises; of a file that
    the new result does not have, none stays.

    Yields
    ------
    dict of str to path
        In the same folder, by the names of `FILES` and `MAY_BE_MISSING`.

    Raises
    ------
    SeipError
        A file cannot be written.
    """
    part = {name: unfinished_name(folder, name) for name in (*MAY_BE_MISSING, *FILES)}
    try:
        yield part
        (folder / FILES[-1]).unlink(missing_ok=True)
        for name, temporary in part.items():
            if temporary.exists():
                temporary.replace(folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SeipError(f"cannot write to {folder}: {reason}; choose a folder that you may write to") from error
    finally:
        for temporary in part.values():
            temporary.unlink(missing_ok=True)


def write_result_folder(
    folder: Path,
    scene: bpy.types.Scene,
    survey: Survey,
    solution: Solution,
    record: PlacementRecord,
    *,
    render: bool = True,
) -> Generator[Progress, None, None]:
    """Write a solution into the scene and all its files into a folder, in place of earlier ones.

    Parameters
    ----------
    scene : bpy.types.Scene
        Receives the sensors and the coverage.
    record : PlacementRecord
        Content of ``placement.json``.
    render : bool
        Whether to render ``view.png``, which takes the longest.
    """
    site, deployment = survey.site, solution.deployment
    with result_files(folder) as part:
        tidy_pieces(scene)
        write_result(scene, site, deployment)
        _save_placed(part["placed.blend"], scene, site, deployment, record)
        with TemporaryDirectory(prefix="seip-") as temporary:
            raw, created = Path(temporary) / "view.png", record.times.created
            rendering = render_elsewhere(raw, part["placed.blend"], scene.name, site, deployment)
            with closing(rendering):
                if render:
                    next(rendering)  # starts the other Blender, which renders while this one writes
                save_glb(part["scene.glb"], site.attribution)
                yield from write_tables(part, survey, solution, record)
                if render:
                    sight, legend = (yield from rendering), shown_legend(scene)
                    save_labelled_view(part["view.png"], raw, site, deployment, legend, sight, created=created)


def _save_placed(
    path: Path, scene: bpy.types.Scene, site: Site, deployment: Deployment, record: PlacementRecord
) -> None:
    """Save the scene with its placement as a custom property: only the add-on has properties of its own."""
    seen = packed_counts(deployment.seen_by)
    scene[contract.PLACEMENT] = {"record": record.text(), "targets": digest(site.targets.xyz), "seen": seen}
    try:
        save_blend(path)
    finally:
        del scene[contract.PLACEMENT]


def write_tables(
    part: Mapping[str, Path], survey: Survey, solution: Solution, record: PlacementRecord
) -> Generator[Progress, None, None]:
    """Write the files of a result that do not depend on Blender's data."""
    geometry, site, models, deployment = survey.geometry, survey.site, survey.models, solution.deployment
    yield Progress(0, 2, "writing tables", counted=False)
    save_placement(part["placement.json"], record)
    problem = placement_constraints(site, models, solution.objective)
    save_site_file(part["site.npz"], record.inputs["visibility"], geometry, site, solution, problem)
    if site.attribution:
        part[ATTRIBUTION_FILE].write_text("\n".join(site.attribution) + "\n", encoding="utf-8", newline="\n")
    placed = located(geometry, site, deployment)
    if placed is not None:
        save_geojson(part["placement.geojson"], placed)
        save_kml(part["placement.kml"], placed)
    yield Progress(1, 2, "drawing the plan", counted=False)
    created = record.times.created
    save_png(part["plan.png"], draw_plan(geometry, site, deployment, solution.caption, created=created))
