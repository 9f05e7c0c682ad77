import sys
from pathlib import Path
sys.path.insert(0, str(Path(__file__).parent))
import bpy
from driver import Window, play

def scenario(w):
    yield from w.open_sidebar("SEIP")
    yield from w.enter("seip.survey.grid", "4")
    print("grid", bpy.context.scene.seip.survey.grid)
    yield from w.enter("seip.goal.count", "2")
    print("count", bpy.context.scene.seip.goal.count)
    yield from w.click("seip.solve_placement(")
    yield 1
    yield from w.picture("running")
    yield from w.until(lambda: "SEIP Sensors" in bpy.data.collections, 100)
    yield from w.picture("placed")

play(scenario, Window(Path("/tmp/gui")))
