"""Performances as glTF animations: any viewer plays the bones, and `read_performance` reads all."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError, InputError
from devices.skeleton import Skeleton
from replay.gltf.checked_json import Entry
from replay.gltf.file import MOST_BYTES, GltfFile
from replay.text_file import file_bytes
from runtime.output.files.glb import GlbBuilder
from runtime.session.performance import PLACEMENT, Performance

Singles = NDArray[np.float32]

NAME = "bunrakuPerformance"
_NONE = -1.0  # stands for no clearance, as files must not hold NaN
_MOST_NODES = 100_000


def save_performance(path: Path, performance: Performance, skeleton: Skeleton) -> None:
    """Write a performance as a .glb that also shows the skeleton.

    Node 0 carries the character's way over the stage, and nodes 1 to K are the skeleton's. The
    arrays of the performance are stored to the bit, and named in the asset's extras.

    Args:
        path: ends in .glb.
        performance: what the character did.
        skeleton: the character's nodes at rest, rooted as the performance has them.

    Raises:
        InputError: the disk fails.
    """
    builder = GlbBuilder()
    rest, parents = skeleton.rest_positions, skeleton.parents
    offsets = rest - np.where(parents[:, None] >= 0, rest[parents], 0.0)
    nodes: list[dict[str, Any]] = [{"name": "stage", "children": [1 + skeleton.root]}]
    for node, name in enumerate(skeleton.names):
        item: dict[str, Any] = {"name": name, "translation": offsets[node].tolist()}
        below = (1 + np.flatnonzero(parents == node)).tolist()
        nodes.append(item | ({"children": below} if below else {}))
    stored: dict[str, Any] = {
        "times": builder.add_array(performance.times, bounds=True),
        "nodes": performance.nodes.tolist(),
        "turns": [builder.add_array(_column(performance.turns, n)) for n in _each(performance)],
        "shifts": [builder.add_array(_column(performance.shifts, n)) for n in _each(performance)],
    }
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []

    def channel(node: int, path: str, output: int) -> None:
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": stored["times"], "output": output})

    for row, node in enumerate(performance.nodes.tolist()):
        channel(1 + node, "rotation", stored["turns"][row])
        shifts = performance.shifts[:, row]
        if shifts.any():
            moved = (offsets[node] + shifts).astype(np.float32)
            channel(1 + node, "translation", builder.add_array(moved))
    if performance.placements is not None:
        columns = np.nan_to_num(performance.placements, nan=_NONE)
        stored["placements"] = [builder.add_array(_single(column)) for column in columns.T]
        turn, x, z, lift, clearance = columns.T
        half = 0.5 * turn.astype(np.float64)
        about = np.column_stack([0.0 * half, np.sin(half), 0.0 * half, np.cos(half)])
        rise = np.where(clearance < 0.0, lift, 0.0)
        channel(0, "rotation", builder.add_array(about.astype(np.float32)))
        channel(0, "translation", builder.add_array(_single(np.column_stack([x, rise, z]))))
    if performance.face is not None:
        stored["face"] = [builder.add_array(_single(column)) for column in performance.face.T]
    builder.document["asset"]["extras"] = {NAME: stored}
    builder.document |= {"nodes": nodes, "scenes": [{"nodes": [0]}], "scene": 0}
    if channels:
        animation = {"name": "take", "samplers": samplers, "channels": channels}
        builder.document["animations"] = [animation]
    builder.save(path)


def read_performance(path: Path) -> Performance:
    """Read what `save_performance` wrote, to the bit.

    Raises:
        InputError: the file cannot be read, or is no such file.
    """
    try:
        file = GltfFile(file_bytes(path, MOST_BYTES), path.parent)
        asset = file.document.child("asset")
        extras = None if asset is None else asset.child("extras")
        stored = None if extras is None else extras.child(NAME)
        if stored is None:
            raise ContentError("it holds no performance")
        return _performance(file, stored)
    except (ContentError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}") from error


def _performance(file: GltfFile, stored: Entry) -> Performance:
    times = _numbers(file, [stored.whole("times")], "SCALAR")[0][:, 0]
    nodes = stored.wholes("nodes", below=_MOST_NODES)
    turns = _numbers(file, stored.wholes("turns", below=1 << 30), "VEC4")
    shifts = _numbers(file, stored.wholes("shifts", below=1 << 30), "VEC3")
    if sorted(set(nodes)) != nodes or not len(nodes) == len(turns) == len(shifts):
        raise ContentError("its nodes do not fit its turns")
    frames = len(times)
    placements, face = None, None
    if "placements" in stored:
        columns = _numbers(file, stored.wholes("placements", below=1 << 30), "SCALAR")
        if len(columns) != len(PLACEMENT):
            raise ContentError("its placements have another number of columns")
        placements = np.hstack(columns)
        placements[placements[:, 4] < 0.0, 4] = math.nan
    if "face" in stored:
        face = np.hstack(_numbers(file, stored.wholes("face", below=1 << 30), "SCALAR"))
    performance = Performance(
        times,
        np.array(nodes, dtype=np.int64),
        np.stack(turns, axis=1) if turns else np.zeros((frames, 0, 4), np.float32),
        np.stack(shifts, axis=1) if shifts else np.zeros((frames, 0, 3), np.float32),
        placements,
        face,
    )
    if not all(np.isfinite(each).all() for each in (times, performance.turns, performance.shifts)):
        raise ContentError("it holds numbers that are not finite")
    for columns_of in (placements, face):
        if columns_of is not None and (len(columns_of) != frames or np.isinf(columns_of).any()):
            raise ContentError("its columns do not fit its times")
    return performance


def _numbers(file: GltfFile, accessors: list[int], kind: str) -> list[Singles]:
    return [file.floats(accessor, kind).astype(np.float32) for accessor in accessors]


def _each(performance: Performance) -> range:
    return range(len(performance.nodes))


def _column(values: Singles, row: int) -> Singles:
    return _single(values[:, row])


def _single(values: NDArray[np.floating]) -> Singles:
    return np.ascontiguousarray(values, dtype=np.float32)
