"""Files of a network of sites."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...storage.files import save_json, whole_file
from ..report.html import as_html
from ..report.pdf import as_pdf
from ..results.file_names import REPORT_FILES
from .network_page import network_page
from .network_pictures import MAP_SHAPE, draw_curve, draw_map
from .network_record import NetworkRecord, network_json
from .network_report import make_network_report
from .network_tables import save_network_geojson, save_sites_table
from .network_view import Street, network_view

NETWORK_FILES = ("network.json", "network.geojson", "sites.csv")
PICTURES = ("map.png", "curve.png")
PAGE = "network.html"


def write_network(folder: Path, record: NetworkRecord, streets: Sequence[Street] | None = None) -> tuple[Path, ...]:
    """Write record, tables, pictures, map and report of a network; the same arguments give the same bytes.

    Parameters
    ----------
    folder : Path
        Created if it is missing.
    streets : sequence of ((n, 2) float64, int), optional
        Background of the maps: latitudes and longitudes of each street in degrees, and its importance from 0 to 2.

    Returns
    -------
    tuple of path

    Raises
    ------
    SeipError
        The folder or a file cannot be written.
    """
    picture = draw_map(record, network_view(record, streets, (MAP_SHAPE, MAP_SHAPE)))
    curve = draw_curve(record)
    report = make_network_report(record, picture, curve)
    contents = (picture, curve, network_page(record, streets).encode(), as_html(report).encode(), as_pdf(report))
    save_json(folder / NETWORK_FILES[0], network_json(record))
    save_network_geojson(folder / NETWORK_FILES[1], record)
    save_sites_table(folder / NETWORK_FILES[2], record)
    names = (*PICTURES, PAGE, *REPORT_FILES)
    for name, content in zip(names, contents, strict=True):
        with whole_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return tuple(folder / name for name in (*NETWORK_FILES, *names))
