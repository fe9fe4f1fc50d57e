"""Energy, stretch and inverted triangles of a performing surface, counted for the report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.signal.histogram import count, percentile
from solvers.signal.streaming_median import StreamingMedian
from solvers.surface.surface_quality import SurfaceQuality

EACH_FRAME = 4_000  # vertices; a larger surface is looked at every so many frames
_BIN = 0.005  # of stretch
_BINS = 2001  # more than ten counts as ten

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Finding:
    """The figures of one frame.

    Attributes:
        energy: as-rigid-as-possible energy of the triangles over the area at rest: 0 at rest, about
            the square of a typical strain.
        stretch_p99: 99th percentile of the edges' relative change of length.
        stretch_max: the largest.
        inverted: number of inverted triangles.
        longest: number of frames for which one triangle has been inverted, at most.
    """

    energy: float
    stretch_p99: float
    stretch_max: float
    inverted: int
    longest: int


class Watchdog:
    """Counts what `SurfaceQuality` and edge stretch say about a surface, frame by frame.

    A surface of more than `EACH_FRAME` vertices is measured only every so many frames; its figures
    still count in frames.

    Args:
        vertices: (N, 3) [m] rest positions.
        faces: (F, 3) triangles.

    Attributes:
        last: figures of the last frame that was measured; None before the first.
    """

    def __init__(self, vertices: Array, faces: Indices) -> None:
        self._quality = SurfaceQuality(vertices, faces)
        self._runs = np.zeros(len(self._quality.inverted), np.int64)  # frames inverted in a row
        self._counts = np.zeros(_BINS, np.int64)
        self._stride = max(1, -(-len(vertices) // EACH_FRAME))
        self._frames = self._bad = 0
        self._energies = StreamingMedian()
        self._worst = Finding(0.0, 0.0, 0.0, 0, 0)
        self.last: Finding | None = None

    def add(self, vertices: Array, stretch: Array) -> None:
        """Measure one deformed surface, if it is its turn.

        Args:
            vertices: (N, 3) [m].
            stretch: (E,) relative change of the length of its edges.
        """
        if self._frames % self._stride == 0:
            self.last = found = self._figures(vertices, stretch)
            self._bad += found.inverted > 0
            self._energies.add(found.energy)
            worst = self._worst
            self._worst = Finding(
                max(worst.energy, found.energy),
                max(worst.stretch_p99, found.stretch_p99),
                max(worst.stretch_max, found.stretch_max),
                max(worst.inverted, found.inverted),
                max(worst.longest, found.longest),
            )
        self._frames += 1

    def _figures(self, vertices: Array, stretch: Array) -> Finding:
        self._quality.measure(vertices)
        inverted = self._quality.inverted
        self._runs += self._stride
        self._runs *= inverted
        self._counts[:] = 0
        count(stretch, _BIN, self._counts)
        most = float(stretch.max(initial=0.0))
        return Finding(
            energy=self._quality.energy,
            stretch_p99=float(percentile(self._counts, _BIN, 99.0)),
            stretch_max=most if most < np.inf else np.inf,  # also when it is not a number
            inverted=int(np.count_nonzero(inverted)),
            longest=int(self._runs.max(initial=0)),
        )

    def summary(self) -> dict[str, Any]:
        """The report's part ``watchdog``.

        ``energy`` {p50, max}, ``stretch`` {p99, max}: of the worst frame and the worst edge,
        ``inverted`` {max, last, longest, frames}: triangles in the worst frame and the last, the
        frames that the same triangle stayed inverted at most, and the frames that had any.
        """
        worst, last = self._worst, self.last
        return {
            "energy": {"p50": self._energies.median, "max": worst.energy},
            "stretch": {"p99": worst.stretch_p99, "max": worst.stretch_max},
            "inverted": {
                "max": worst.inverted,
                "last": 0 if last is None else last.inverted,
                "longest": worst.longest,
                "frames": min(self._bad * self._stride, self._frames),
            },
        }
