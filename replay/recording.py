"""What a recording is, whatever file it came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame


@dataclass(frozen=True, eq=False)
class Recording:
    """Every frame of a recorded performance, as stacked arrays.

    Attributes:
        skeleton: the skeleton of all frames.
        times: (T,) [s] the performers' time, never falling, starts at 0.
        positions: (T, J, 3) [m], right-handed, +Y up, the performer faces +Z at the start; NaN
            where a joint was not seen.
        rotations: (T, J, 4) quaternions (x, y, z, w), joint to world, or None.
        confidence: (T, J) in [0, 1], 0 where the position is NaN.
        performers: (T,) int, whose frame each is.
        arrivals: (T,) [s] when each came in; NaN where the file does not say.
        notes: what the reader guessed or mended, one short line each, for `bunraku info`.

    Raises:
        InputError: no frame at all.
    """

    skeleton: Skeleton
    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    confidence: NDArray[np.float64]
    performers: NDArray[np.int64]
    arrivals: NDArray[np.float64]
    notes: tuple[str, ...] = ()

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

    def __len__(self) -> int:
        return len(self.times)

    @property
    def seconds(self) -> float:
        """From the first frame to the last [s]."""
        return float(self.times[-1] - self.times[0])

    def frame(self, index: int) -> SkeletonFrame:
        """The frame numbered `index`, from 0."""
        return SkeletonFrame(
            time=float(self.times[index]),
            positions=self.positions[index],
            rotations=None if self.rotations is None else self.rotations[index],
            confidence=self.confidence[index],
            performer=int(self.performers[index]),
            arrival=float(self.arrivals[index]),
        )
