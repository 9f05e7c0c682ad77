"""Pieces of larger things: the windows of a building, the body and post of a sensor.

A piece is the child of its whole and names it in ``seip_piece_of``. Blender leaves children behind when their parent is
deleted; by the name a piece whose whole is gone is told from one that was only taken off it.
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from . import contract


def attach_piece(piece: bpy.types.Object, whole: bpy.types.Object) -> None:
    """Make an object a piece of another; its transform is now relative to the other."""
    piece.parent = whole
    piece[contract.PIECE_OF] = whole.name


def rename_whole(whole: bpy.types.Object, name: str) -> None:
    """Rename an object, and the name that its pieces have of it."""
    pieces = [piece for piece in whole.children if contract.PIECE_OF in piece]
    whole.name = name
    for piece in pieces:
        piece[contract.PIECE_OF] = whole.name


def loose_pieces(objects: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Return the pieces among objects whose whole is gone; one that was only taken off its whole is not among them."""
    return [
        obj
        for obj in objects
        if obj.parent is None and contract.PIECE_OF in obj and obj[contract.PIECE_OF] not in bpy.data.objects
    ]


def copied_pieces(objects: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Return the pieces of copies among objects: Blender gives these their new parent, but they name the original."""
    return [
        obj
        for obj in objects
        if obj.parent is not None
        and contract.PIECE_OF in obj
        and obj[contract.PIECE_OF] != obj.parent.name
        and contract.NUMBER.sub("", obj[contract.PIECE_OF]) == contract.NUMBER.sub("", obj.parent.name)
    ]


def tidy_pieces(scene: bpy.types.Scene) -> None:
    """Have pieces of copies name the copy, and delete the pieces whose whole is gone."""
    for piece in copied_pieces(scene.objects):
        piece[contract.PIECE_OF] = piece.parent.name
    bpy.data.batch_remove(loose_pieces(scene.objects))
