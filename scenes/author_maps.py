"""Write the maps of the shipped scenes: ``python -m scenes.author_maps`` from the root of the repository.

``junction.xodr``
    A four-arm signalised urban junction. Two lanes of 3.5 m each way on every arm, pavements of 2 to 4 m, the
    northern arm off the right angle by seven degrees, the western one climbing 1.5 %, the eastern one bending away.
    Its buildings, trees, walls and street lights stand in ``junction.toml``.
``corridor.xodr``
    An arterial street of 680 m with three signalised junctions, the middle one a T. Its buildings, trees, walls and
    street lights are objects of the map; ``corridor.toml`` only says what to study.

Both places are invented, so the maps carry no geographic reference. ``headless/build_scene.py`` builds the scenes
from the site descriptions.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scenes.corridor import corridor_map
from scenes.four_arm_junction import junction_map
from scenes.opendrive_writer import Map, opendrive

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

MAPS: Mapping[str, Callable[[], Map]] = {"junction.xodr": junction_map, "corridor.xodr": corridor_map}


def main() -> None:
    """Write the maps beside this file."""
    for name, author in MAPS.items():
        (Path(__file__).parent / name).write_bytes(opendrive(author()))


if __name__ == "__main__":
    main()
