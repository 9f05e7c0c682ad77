"""Renders a scene's view in a Blender of its own; `render.render_elsewhere` starts it.

blender -b --factory-startup -P render_job.py -- job.json
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

import bpy


def main(job: Path) -> None:
    """Render the picture of a job, and write how it was taken."""
    request = json.loads(job.read_text())
    package = Path(__file__).resolve().parents[1]
    sys.path[:] = [str(package.parent), *request["path"]]
    render = import_module(f"{package.name}.scene.render")  # no extension is installed here

    bpy.ops.wm.open_mainfile(filepath=request["blend"], load_ui=False, use_scripts=False)
    shot, scene = render.Shot.from_json(request["shot"]), bpy.data.scenes[request["scene"]]
    number, hidden = render.take(shot, scene, Path(request["raw"]))
    Path(request["answer"]).write_text(json.dumps([number, hidden.tolist()]))


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]))
