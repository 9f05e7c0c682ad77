"""The choice of sensors."""

from __future__ import annotations

import time
from collections.abc import Generator

import bpy

from .. import state
from ..core.goal import Goal, Plan, check_goal
from ..core.progress import Progress
from ..core.survey import place
from ..scene.write import write_result
from .visibility import seen
from .work import LongWork


class SEIP_OT_solve_placement(LongWork[Plan], bpy.types.Operator):
    """Choose the sensors that cover most, or the cheapest that cover enough, and put them into the scene"""

    bl_idname = "seip.solve_placement"
    bl_label = "Place Sensors"

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, Plan]:
        """Read the scene as it is now, and state the goal."""
        goal = scene.seip.goal.goal()
        self._held = state.read(scene)
        check_goal(self._held.layout.site, self._held.layout.models, goal)
        return self._work(goal)

    def _work(self, goal: Goal) -> Generator[Progress, None, Plan]:
        grid = yield from seen(self._held)
        self._began = time.perf_counter()
        return (yield from place(self._held.layout, grid, goal))

    def conclude(self, scene: bpy.types.Scene, result: Plan) -> None:
        """Put the sensors into the scene."""
        self._held.plan = result
        self._held.durations["placement"] = time.perf_counter() - self._began
        write_result(scene, self._held.layout.site, result.deployment)
        self.report({"INFO"}, f"coverage {result.deployment.coverage:.2%}")


CLASSES = (SEIP_OT_solve_placement,)
