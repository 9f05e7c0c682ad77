"""Install the extension's zip, place sensors with it, disable it, and see that it leaves nothing behind.

python .ci/use_installed.py ZIP SCENE, or blender -b --python-exit-code 1 -P .ci/use_installed.py -- ZIP SCENE, with
BLENDER_USER_RESOURCES set to an empty folder.
"""

import sys

import bpy

KEY = "bl_ext.user_default.seip"


def traces() -> dict[str, set[str]]:
    """Return what an add-on may leave in Blender."""
    handlers = (name for name in dir(bpy.app.handlers) if isinstance(getattr(bpy.app.handlers, name), list))
    return {
        "types": set(dir(bpy.types)),
        "operators": set(dir(bpy.ops.seip)),
        "scene properties": set(bpy.types.Scene.bl_rna.properties.keys()),
        "object properties": set(bpy.types.Object.bl_rna.properties.keys()),
        "handlers": {
            f"{name} {getattr(one, '__module__', '')}" for name in handlers for one in getattr(bpy.app.handlers, name)
        },
    }


def main(archive: str, scene: str) -> None:
    """Do it all; whatever is wrong raises."""
    bpy.ops.wm.read_factory_settings()
    before = traces()
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    if KEY not in bpy.context.preferences.addons:
        sys.exit(f"{KEY} was not enabled")
    bpy.ops.wm.open_mainfile(filepath=scene)
    seip = bpy.context.scene.seip
    seip.survey.heights, seip.survey.grid, seip.survey.spacing, seip.goal.count = "8", 4.0, 12.0, 2
    if bpy.ops.seip.solve_placement() != {"FINISHED"}:
        sys.exit("no sensors were placed")
    empties = [obj for obj in bpy.data.collections["SEIP Sensors"].objects if obj.type == "EMPTY"]
    bpy.ops.preferences.addon_disable(module=KEY)
    left = {what: names - before[what] for what, names in traces().items() if names - before[what]}
    if len(empties) != 2 or left:
        sys.exit(f"{len(empties)} sensors were placed; left behind: {left}")
    print(f"Blender {bpy.app.version_string}: installed, placed {len(empties)} sensors, disabled, nothing left")  # noqa: T201


given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
main(*given)
