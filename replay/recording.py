"""A recording in memory: the frames of one file as stacked arrays, independent of its format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from devices.blend_shapes import Blends
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame


@dataclass(frozen=True, eq=False)
class Recording:
    """Every frame of a recording as stacked arrays.

    Attributes:
        skeleton: the skeleton of all frames.
        times: (T,) [s] the performers' time, never falling, starts at 0.
        positions: (T, J, 3) [m], right-handed, +Y up, the performer faces +Z at the start; NaN
            where a joint was not seen.
        rotations: (T, J, 4) quaternions (x, y, z, w), joint to world, or None.
        confidence: (T, J) in [0, 1], 0 where the position is NaN.
        performers: (T,) int, the performer of each frame.
        arrivals: (T,) [s] arrival of each frame; NaN where the file has none.
        notes: guesses and corrections of the reader, one short line each, for `bunraku info`.
        blends: of each frame the weights of its face's blend shapes as in `SkeletonFrame`, T of
            them; None where no frame has any.
        source: facts about the origin of the frames, if the file has them: short texts by name.

    Raises:
        InputError: there is no frame.
    """

    skeleton: Skeleton
    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    confidence: NDArray[np.float64]
    performers: NDArray[np.int64]
    arrivals: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    source: Mapping[str, str] = field(default_factory=dict)
    blends: tuple[Blends | None, ...] | None = None

    def __post_init__(self) -> None:
        frames, joints = len(self.times), len(self.skeleton.names)
        if frames == 0:
            raise InputError("the recording holds no frame")
        expected = {
            "positions": (frames, joints, 3),
            "confidence": (frames, joints),
            "performers": (frames,),
            "arrivals": (frames,),
        }
        if self.rotations is not None:
            expected["rotations"] = (frames, joints, 4)
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ValueError(
                    f"Expected `{name}` to have shape {shape}, got {getattr(self, name).shape}"
                )
        if self.blends is not None and len(self.blends) != frames:
            raise ValueError(f"Expected {frames} faces in `blends`, got {len(self.blends)}")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def seconds(self) -> float:
        """Time from the first frame to the last [s]."""
        return float(self.times[-1] - self.times[0])

    def frame(self, index: int) -> SkeletonFrame:
        """Return frame number `index`, from 0."""
        return SkeletonFrame(
            time=float(self.times[index]),
            positions=self.positions[index],
            rotations=None if self.rotations is None else self.rotations[index],
            confidence=self.confidence[index],
            performer=int(self.performers[index]),
            arrival=float(self.arrivals[index]),
            blends=None if self.blends is None else self.blends[index],
        )

    def of(self, performer: int) -> Recording:
        """Return the frames of one performer; times are unchanged.

        Raises:
            InputError: no performer has that number; the message lists the known ones.
        """
        own = self.performers == performer
        if not own.any():
            there = ", ".join(str(number) for number in np.unique(self.performers))
            raise InputError(
                f"there is no performer {performer} in the recording; known performers: {there}"
            )
        return replace(
            self,
            times=self.times[own],
            positions=self.positions[own],
            rotations=None if self.rotations is None else self.rotations[own],
            confidence=self.confidence[own],
            performers=self.performers[own],
            arrivals=self.arrivals[own],
            blends=None
            if self.blends is None
            else tuple(face for face, mine in zip(self.blends, own, strict=True) if mine),
        )
