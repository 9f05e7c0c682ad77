"""The light of day: a sun and a pale sky, the same in every scene that is made here."""

from __future__ import annotations

import math

import bpy

from .materials import nodes_of

SUN_TURN = (math.radians(38.0), math.radians(-18.0), math.radians(20.0))
SUN_STRENGTH, SUN_ANGLE = 2.3, math.radians(3.0)
SKY, SKY_STRENGTH = (0.80, 0.88, 1.0, 1.0), 0.42


def add_daylight(scene: bpy.types.Scene, collection: bpy.types.Collection) -> bpy.types.Object:
    """Put a sun into a collection of the scene, and a sky behind it; return the sun."""
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = SUN_STRENGTH, SUN_ANGLE
    sun = bpy.data.objects.new("Sun", light)
    sun.rotation_euler = SUN_TURN
    sun.location = (0.0, 0.0, 60.0)
    collection.objects.link(sun)
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.color = SKY[:3]
    background = next(node for node in nodes_of(scene.world) if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = SKY
    background.inputs["Strength"].default_value = SKY_STRENGTH
    return sun
