"""Moves, turns, scales, mirrors and time-shifts parts together with their motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.editing.motion import Clip, Quaternion
from solvers.editing.part import Bone, Node, Part, Vector, quaternion_of, vector_of
from solvers.editing.turns import led, product
from solvers.skeleton.quaternions import rotate

Array = NDArray[np.float64]


def moved(part: Part, shift: Vector) -> Part:
    """Move a part.

    o---o          shift ->     o---o
    """
    return replace(part, place=vector_of(np.array(part.place) + shift))


def turned(part: Part, rotation: Quaternion, pivot: Vector) -> Part:
    """Turn a part about a point, at every time: a modelling turn of its root.

        x--o---o            x
                            |
                            o---        (a quarter turn about x)

    Args:
        part: the part.
        rotation: unit quaternion (x, y, z, w), world.
        pivot: (x, y, z) what stays where it is.
    """
    unit = quaternion_of(np.array(rotation))
    centre = np.array(pivot)
    place = centre + rotate(np.array(unit), np.array(part.place) - centre)
    root = part.root.bone
    moved_there = replace(part, place=vector_of(place))
    return moved_there.with_bone(part.root.id, replace(root, turns=led(unit, root.turns)))


def scaled(part: Part, factor: float, pivot: Vector) -> Part:
    """Scale a part about a point; it turns as before.

        o-o-o          o---o---o

    Raises:
        ValueError: a factor that is not positive.
    """
    if not 0.0 < factor < np.inf:
        raise ValueError(f"a part is scaled by a positive number, got {factor:g}")
    centre = np.array(pivot)
    place = centre + factor * (np.array(part.place) - centre)
    nodes = tuple(
        _with(node, replace(node.bone, stem=vector_of(factor * np.array(node.bone.stem))))
        for node in part.nodes
    )
    return Part(vector_of(place), nodes)


def mirrored(part: Part, point: Vector, normal: ArrayLike) -> Part:
    """Mirror a part and its motion in a plane.

           o                            o
          /       |                      \\
        o         |         ->            o

    The mirror image of a rotation is the rotation, turned by half a turn about the normal.

    Args:
        part: the part.
        point: (x, y, z) on the plane.
        normal: (3,) of the plane, any length but 0.

    Raises:
        ValueError: the normal has no length.
    """
    across = np.asarray(normal, dtype=np.float64)
    length = float(np.linalg.norm(across))
    if across.shape != (3,) or not 0.0 < length < np.inf:
        raise ValueError(f"a plane's normal is a vector with a length, got {normal!r}")
    across = across / length
    half = quaternion_of(np.concatenate([across, [0.0]]))
    images: dict[Clip, Clip] = {}

    def image(clip: Clip) -> Clip:
        return images.setdefault(clip, replace(clip, change=product(half, clip.change)))

    def mirror(node: Node) -> Node:
        stem = np.array(node.bone.stem)
        turns = tuple(
            replace(turn, model=_mirrored(turn.model, across)) for turn in node.bone.turns
        )
        reflected = vector_of(stem - 2.0 * (stem @ across) * across)
        return _with(node, replace(node.bone, stem=reflected, turns=turns))

    place = np.array(part.place)
    place = place - 2.0 * ((place - point) @ across) * across
    whole = Part(vector_of(place), tuple(map(mirror, part.nodes)))
    return with_clips(whole, image)


def delayed(part: Part, seconds: float) -> Part:
    """Shift all clips of a part in time, later where positive."""
    return with_clips(part, lambda clip: replace(clip, start=clip.start + seconds))


def with_clips(part: Part, change: Callable[[Clip], Clip]) -> Part:
    """Replace every clip of a part by what `change` makes of it."""

    def changed(node: Node) -> Node:
        turns = tuple(
            replace(
                turn,
                layers=tuple(replace(layer, clip=change(layer.clip)) for layer in turn.layers),
            )
            for turn in node.bone.turns
        )
        return _with(node, replace(node.bone, turns=turns))

    return replace(part, nodes=tuple(map(changed, part.nodes)))


def _with(node: Node, bone: Bone) -> Node:
    return replace(node, bone=bone)


def _mirrored(turn: Quaternion, across: Array) -> Quaternion:
    axis = np.array(turn[:3])
    x, y, z = (2.0 * (axis @ across) * across - axis).tolist()
    return x, y, z, turn[3]
