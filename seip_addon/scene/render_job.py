"""Renders a scene's view in a Blender of its own; `render_elsewhere.render_elsewhere` starts it.

blender -b --factory-startup -P render_job.py -- job.json
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

import bpy


def main(job: Path) -> None:
    """Render what a job asks for, and write how each picture was taken."""
    request = json.loads(job.read_text())
    package = Path(__file__).resolve().parents[1]
    sys.path[:] = [str(package.parent), *request["path"]]
    render = import_module(f"{package.name}.scene.render")  # no extension is installed here

    bpy.ops.wm.open_mainfile(filepath=request["blend"], load_ui=False, use_scripts=False)
    shots = [render.Shot.from_json(shot) for shot in request["shots"]]
    taken = render.take(shots, bpy.data.scenes[request["scene"]], [Path(raw) for raw in request["raws"]])
    Path(request["answer"]).write_text(json.dumps([one.as_json() for one in taken]))


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]))
