"""A small character and a show of it, made here: what the tests of the outputs write and read."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton
from runtime.characters.character import Character, Material, Surface
from runtime.driving.targets import PosedNodes
from runtime.output.output import PerformedFrame

RINGS, SIDES, NODES = 25, 12, 7
HEIGHT = 1.2


def make_tentacle() -> Character:
    """A closed tapering tube that stands on y = 0, its nodes along the axis.

    Its file has two vertices for the first side of each ring (a seam), in shuffled order, in
    centimetres with +Z up.
    """
    angles = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    heights = np.linspace(0, HEIGHT, RINGS)
    radii = 0.15 * (1 - 0.7 * heights / HEIGHT)
    ring = np.stack([np.cos(angles), np.zeros(SIDES), np.sin(angles)], axis=1)
    tube = radii[:, None, None] * ring + heights[:, None, None] * np.array([0, 1, 0])
    vertices = np.concatenate([tube.reshape(-1, 3), [[0, 0, 0], [0, HEIGHT, 0]]])
    grid = np.arange(RINGS * SIDES).reshape(RINGS, SIDES)
    here, up = grid[:-1], grid[1:]
    quads = [here, up, np.roll(up, -1, 1), np.roll(here, -1, 1)]
    a, b, c, d = (corner.ravel() for corner in quads)
    bottom, top = RINGS * SIDES, RINGS * SIDES + 1
    first, last = grid[0], grid[-1]
    caps = [
        np.stack([np.full(SIDES, bottom), first, np.roll(first, -1)], 1),
        np.stack([np.full(SIDES, top), np.roll(last, -1), last], 1),
    ]
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1), *caps])

    count = len(vertices)
    shuffled = np.random.default_rng(5).permutation(count + RINGS)
    vertex = np.concatenate([np.arange(count), grid[:, 0]])[shuffled]
    place = np.argsort(shuffled)  # (M,) file index of each unshuffled vertex
    across = np.zeros(faces.shape, bool)  # corners beyond the seam: of the last side of each ring
    sides = np.tile(np.arange(SIDES) == SIDES - 1, RINGS - 1)
    across[: len(sides)] = across[len(sides) : 2 * len(sides)] = sides[:, None]
    across &= (faces % SIDES == 0) & (faces < RINGS * SIDES)
    split = place[np.where(across, count + faces // SIDES, faces)]
    colors = np.ones((len(vertex), 4), np.float32)
    colors[:, 0] = vertices[vertex, 1] / HEIGHT
    file_to_stage = np.eye(4)
    file_to_stage[:3, :3] = 0.01 * Rotation.from_euler("x", -90, degrees=True).as_matrix()
    file_to_stage[:3, 3] = (0.0, 0.1, 0.0)
    texture = np.full((2, 2, 4), (255, 128, 0, 255), np.uint8)
    return Character(
        name="tentacle",
        vertices=vertices,
        faces=faces.astype(np.int64),
        skeleton=Skeleton(
            names=tuple(f"node {k}" for k in range(NODES)),
            parents=np.arange(NODES) - 1,
            rest_positions=np.linspace([0, 0, 0], [0, HEIGHT, 0], NODES),
        ),
        weights=None,
        surface=Surface(
            vertex=vertex,
            faces=split.astype(np.int32),
            colors=colors,
            uvs=np.tile(np.float32([0.25, 0.125]), (len(vertex), 1)),
            materials=(
                Material(np.float32([0.5, 1.0, 0.25, 1.0])),
                Material(np.ones(4, np.float32), texture),
            ),
            face_material=(np.arange(len(faces)) % 2).astype(np.int64),
        ),
        file_to_stage=file_to_stage,
    )


def make_show(
    character: Character, frames: int = 40, rate: float = 30.0, size: tuple[int, int] | None = None
) -> list[PerformedFrame]:
    """A bend that grows and turns, with pictures (H, W) when `size` gives their width, height."""
    return [_perform(character, index, index / rate, size) for index in range(frames)]


def _perform(
    character: Character, index: int, time: float, size: tuple[int, int] | None
) -> PerformedFrame:
    nodes = character.skeleton.rest_positions
    bend = np.stack([0.5 * time * np.ones(NODES), np.zeros(NODES), np.full(NODES, 0.2)], 1)
    rotations = Rotation.from_rotvec(bend * np.linspace(0, 1.5, NODES)[:, None])
    positions = np.zeros_like(nodes)
    positions[0] = nodes[0] + (0.3 * time, 0, 0)
    turned = rotations[:-1].apply(np.diff(nodes, axis=0))
    positions[1:] = positions[0] + np.cumsum(turned, axis=0)
    return PerformedFrame(
        index=index,
        time=time,
        vertices=_skin(character, positions, rotations),
        nodes=PosedNodes(positions, rotations.as_quat()),
        picture=None if size is None else _picture(index, *size),
    )


def _skin(
    character: Character, positions: NDArray[np.float64], rotations: Rotation
) -> NDArray[np.float64]:
    """Vertices blended, by height, from the two nodes that they lie between."""
    along = character.vertices[:, 1] / HEIGHT * (NODES - 1)
    below = np.clip(along.astype(int), 0, NODES - 2)
    share = (along - below)[:, None]
    rest = character.skeleton.rest_positions

    def moved(node: NDArray[np.int64]) -> NDArray[np.float64]:
        return rotations[node].apply(character.vertices - rest[node]) + positions[node]

    blended: NDArray[np.float64] = (1 - share) * moved(below) + share * moved(below + 1)
    return blended


def _picture(index: int, width: int, height: int) -> NDArray[np.uint8]:
    """Red on the left, blue on the right, and a white block that moves down."""
    picture = np.zeros((height, width, 4), np.uint8)
    picture[:, : width // 2] = (200, 30, 30, 255)
    picture[:, width // 2 :] = (30, 30, 200, 255)
    top = 2 * index % max(height - 16, 1)
    picture[top : top + 16, 8:24, :3] = 255
    return picture


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """A block in which no file grows beyond `size` bytes, as if the disk were full."""
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)
