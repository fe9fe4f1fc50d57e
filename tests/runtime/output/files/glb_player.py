"""Plays a .glb by the words of the specification, from what pygltflib reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

KINDS = {5126: "<f4", 5125: "<u4", 5123: "<u2"}


class Player:
    """Poses a .glb as the specification says, from what pygltflib reads."""

    def __init__(self, path: Path) -> None:
        self.gltf = pygltflib.GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()

    def array(self, accessor: int) -> NDArray[np.generic]:
        described = self.gltf.accessors[accessor]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[described.type]
        kind, count = described.componentType, described.count
        if described.bufferView is None:
            values = np.zeros((count, width), KINDS[kind])
        else:
            values = self._numbers(described.bufferView, kind, count, width)
        if described.sparse is not None:
            few, places = described.sparse.count, described.sparse.indices
            rows = self._numbers(places.bufferView, places.componentType, few, 1)[:, 0]
            assert (np.diff(rows.astype(int)) > 0).all()
            values[rows] = self._numbers(described.sparse.values.bufferView, kind, few, width)
        if described.max:
            np.testing.assert_array_equal(values.max(axis=0), np.float32(described.max))
            np.testing.assert_array_equal(values.min(axis=0), np.float32(described.min))
        return values

    def _numbers(self, view: int, kind: int, count: int, width: int) -> NDArray[np.generic]:
        place = self.gltf.bufferViews[view]
        values = np.frombuffer(self.blob, KINDS[kind], count * width, place.byteOffset)
        assert values.nbytes == place.byteLength
        return values.reshape(count, width)

    def node_matrices(self, time: float) -> NDArray[np.float64]:
        """Global matrices (nodes, 4, 4) at `time` [s]."""
        local = [[np.array(node.translation or (0, 0, 0)), Rotation.identity()]
                 for node in self.gltf.nodes]  # fmt: skip
        for animation in self.gltf.animations:
            for channel in animation.channels:
                if channel.target.path == "weights":
                    continue
                sampler = animation.samplers[channel.sampler]
                times = self.array(sampler.input)[:, 0].astype(float)
                values = self.array(sampler.output).astype(float)
                if channel.target.path == "translation":
                    moved = [np.interp(time, times, values[:, axis]) for axis in range(3)]
                    local[channel.target.node][0] = np.array(moved)
                else:
                    turns = Rotation.from_quat(values)
                    shown = np.clip(time, times[0], times[-1])
                    turn = Slerp(times, turns)(shown) if len(times) > 1 else turns[0]
                    local[channel.target.node][1] = turn
        matrices = np.tile(np.eye(4), (len(local), 1, 1))

        def place(node: int, parent: NDArray[np.float64]) -> None:
            matrices[node, :3, :3] = local[node][1].as_matrix()
            matrices[node, :3, 3] = local[node][0]
            matrices[node] = parent @ matrices[node]
            for child in self.gltf.nodes[node].children or ():
                place(child, matrices[node])

        for root in self.gltf.scenes[self.gltf.scene].nodes:
            place(root, np.eye(4))
        return matrices

    def morph_weights(self, time: float) -> NDArray[np.float64]:
        """The weights of the mesh's morph targets at `time` [s]."""
        for animation in self.gltf.animations:
            for channel in animation.channels:
                if channel.target.path == "weights":
                    assert self.gltf.nodes[channel.target.node].mesh == 0
                    sampler = animation.samplers[channel.sampler]
                    times = self.array(sampler.input)[:, 0].astype(float)
                    rows = self.array(sampler.output).astype(float).reshape(len(times), -1)
                    return np.array([np.interp(time, times, row) for row in rows.T])
        return np.array(self.gltf.meshes[0].weights or [])

    def vertices(self, time: float) -> NDArray[np.float64]:
        """Morphed and skinned file vertices (M, 3) at `time` [s]."""
        primitive = self.gltf.meshes[0].primitives[0]
        attributes = primitive.attributes
        positions = self.array(attributes.POSITION).astype(float)
        for weight, target in zip(self.morph_weights(time), primitive.targets or [], strict=True):
            positions += weight * self.array(target["POSITION"])
        skin = self.gltf.skins[0]
        bind = self.array(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
        joints = self.node_matrices(time)[skin.joints] @ bind
        nodes = self.array(attributes.JOINTS_0)
        weights = self.array(attributes.WEIGHTS_0).astype(float)
        np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
        rest = np.c_[positions, np.ones(len(nodes))]
        return np.einsum("nc,ncij,nj->ni", weights, joints[nodes], rest)[:, :3]
