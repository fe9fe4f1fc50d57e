"""Transfers the motions of all matched chains to a character in one call per frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import power
from solvers.retarget.polyline_motion import ChainMap, follow_bones, sample_bones

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class _Chains(NamedTuple):
    """Several `ChainMap`s in common arrays; rows first[d] to first[d + 1] belong to chain d."""

    first_bone: Ints  # (D + 1,)
    first_sample: Ints  # (D + 1,)
    joints: Ints  # (B + D,) the body's joints that are the sources' nodes
    rest: Array  # (B, 3)
    axes: Array  # (D, 3)
    bones: Ints  # (S, 2)
    shares: Array  # (S,)
    changes: Array  # (D, 3, 3)


@dataclass(frozen=True, slots=True, eq=False)
class ChainRetargetsState:
    """The memory of `ChainRetargets` at one moment.

    Attributes:
        turns: (B, 4) each source bone's turn against its predecessor, zero before the first frame.
        last: (B, 3) each source bone's direction, as its predecessor carries it.
    """

    turns: Array
    last: Array


class ChainRetargets:
    """Transfers D motions of one body to as many target polylines, frame by frame.

    Rotations are measured in the body's world and returned in the targets' world. So the rotation
    of a limb on a bent spine includes the spine's turn.

    Args:
        maps: how each chain's motion is transferred.
        sources: for each chain, the body's joints that are its source's nodes.

    Raises:
        ValueError: the number of joints of a source differs from its number of nodes.
    """

    def __init__(self, maps: Sequence[ChainMap], sources: Sequence[Sequence[int]]) -> None:
        for chain, source in zip(maps, sources, strict=True):
            if len(source) != len(chain.rest) + 1:
                raise ValueError(f"expected {len(chain.rest) + 1} joints, got {len(source)}")
        self._chains = _Chains(
            _firsts([len(chain.rest) for chain in maps]),
            _firsts([len(chain.bones) for chain in maps]),
            np.array([joint for source in sources for joint in source], dtype=np.int64),
            np.concatenate([np.zeros((0, 3)), *(chain.rest for chain in maps)]),
            np.array([chain.axis for chain in maps]).reshape(-1, 3),
            np.concatenate([np.zeros((0, 2), dtype=np.int64), *(chain.bones for chain in maps)]),
            np.concatenate([np.zeros(0), *(chain.shares for chain in maps)]),
            np.array([chain.change for chain in maps]).reshape(-1, 3, 3),
        )
        self._joints = int(self._chains.joints.max(initial=-1)) + 1
        self._turns = np.zeros((len(self._chains.rest), 4))
        self._last = np.zeros((len(self._chains.rest), 3))

    def reset(self) -> None:
        """Forget the last frame, as after a cut."""
        self._turns[:] = 0.0

    def snapshot(self) -> ChainRetargetsState:
        """Return a copy of the memory of the last frame."""
        return ChainRetargetsState(self._turns.copy(), self._last.copy())

    def restore(self, state: ChainRetargetsState) -> None:
        """Go back to a snapshot of retargets with the same maps.

        Raises:
            ValueError: a snapshot of another number of bones.
        """
        if state.turns.shape != self._turns.shape:
            raise ValueError(
                f"expected a state of {len(self._turns)} bones, got {len(state.turns)}"
            )
        self._turns[:], self._last[:] = state.turns, state.last

    def rotations(self, body: Array, gains: Array) -> Array:
        """Return world rotations (S, 4) of all target bones from rest, chain after chain.

        Args:
            body: (J, 3) positions of the body's joints, finite.
            gains: (D,) the share of each chain's turns that is transferred, in (0, 1].

        Raises:
            ValueError: a joint or a gain is missing.
        """
        count = len(self._chains.axes)
        if body.ndim != 2 or body.shape[1] != 3 or len(body) < self._joints:
            raise ValueError(f"expected at least {self._joints} joints (J, 3), got {body.shape}")
        if gains.shape != (count,):
            raise ValueError(f"expected gains of shape ({count},), got {gains.shape}")
        rotations = np.empty((len(self._chains.shares), 4))
        points = np.ascontiguousarray(body, dtype=np.float64)
        _retarget(self._chains, points, gains, self._turns, self._last, rotations)
        return rotations


def _firsts(sizes: Sequence[int]) -> Ints:
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


@kernel
def _retarget(
    chains: _Chains, body: Array, gains: Array, turns: Array, last: Array, out: Array
) -> None:
    for d in range(len(gains)):
        first, end = chains.first_bone[d], chains.first_bone[d + 1]
        pose = body[chains.joints[first + d : end + d + 1]]
        own = turns[first:end]
        follow_bones(chains.rest[first:end], pose, chains.axes[d], own, last[first:end])
        a, b = chains.first_sample[d], chains.first_sample[d + 1]
        sample_bones(own, chains.bones[a:b], chains.shares[a:b], chains.changes[d], out[a:b])
        if gains[d] != 1.0:
            for j in range(a, b):
                q = power((out[j, 0], out[j, 1], out[j, 2], out[j, 3]), gains[d])
                out[j, 0], out[j, 1], out[j, 2], out[j, 3] = q
