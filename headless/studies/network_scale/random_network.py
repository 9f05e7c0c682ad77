"""Random networks: a table of random junctions, each with an OpenStreetMap extract of its own."""

import csv
from collections.abc import Generator
from pathlib import Path

from headless.studies.random_sites.extract_text import LATITUDE, LONGITUDE, write_extract
from headless.studies.random_sites.street_plan import draw_plan

import numpy as np

from seip_addon.core.progress import Progress
from seip_addon.core.storage.files import whole_file

TABLE = "sites.csv"
STEP = 0.02
"""Degrees between neighbouring junctions: a kilometre or more, so that no junction lies within reach of another."""
ROW = 20
"""Number of junctions from west to east."""


def write_random_network(folder: Path, count: int, seed: int) -> Generator[Progress, None, None]:
    """Write ``sites.csv`` and the extracts of its junctions, which `seip network` reads.

    Parameters
    ----------
    folder : Path
        Exists already.
    count, seed : int
        Number of junctions, and seed of their streets, buildings and trees.
    """
    rows = []
    for number in range(count):
        middle = (LATITUDE + STEP * (number // ROW), LONGITUDE + STEP * (number % ROW))
        source = f"junction-{number + 1:04d}.osm"
        write_extract(folder / source, draw_plan(np.random.default_rng([seed, number])), middle)
        rows.append((source, f"{middle[0]:.5f}", f"{middle[1]:.5f}", f"Junction {number + 1}"))
        yield Progress(number + 1, count, "random junctions")
    with whole_file(folder / TABLE) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("source", "latitude", "longitude", "name"))
        writer.writerows(rows)
