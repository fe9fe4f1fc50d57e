"""Compare pictures with golden ones, region by region, and show where they differ."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

FOLDER = Path(__file__).resolve().parents[2] / "data" / "golden"
REGION = 16  # [px] least width and height of a region
MOST_MEAN = 0.6  # of 255: a rounding here and there, and four edge pixels of another coverage
MOST_PIXEL = 72  # of 255: one of an edge pixel's four samples is 64, and roundings
AMPLIFIED = 8  # how much brighter than the difference its picture is

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """How far a picture is from the golden one.

    Attributes:
        difference: (H, W) the largest difference of a pixel's channels, of 255.
    """

    difference: NDArray[np.int64]

    @classmethod
    def of(cls, picture: Picture, golden: Picture) -> Comparison:
        """Compare two pictures (H, W, 4) of one size."""
        assert picture.shape == golden.shape, f"{picture.shape}, golden {golden.shape}"
        return cls(np.abs(picture.astype(np.int64) - golden).max(axis=2))

    @property
    def means(self) -> NDArray[np.float64]:
        """The mean of each region (R, C)."""
        rows, columns = self._edges
        sums = np.add.reduceat(np.add.reduceat(self.difference, rows[:-1]), columns[:-1], axis=1)
        means: NDArray[np.float64] = sums / np.outer(np.diff(rows), np.diff(columns))
        return means

    @property
    def _edges(self) -> list[NDArray[np.int64]]:
        """The first row of each region and the picture's height; the same for columns."""
        return [
            np.linspace(0, length, length // REGION + 1).astype(np.int64)
            for length in self.difference.shape
        ]

    @property
    def fault(self) -> str:
        """The worst region beyond the limits in words; empty where all are within them."""
        row, column = np.unravel_index(self.means.argmax(), self.means.shape)
        if self.means.max() <= MOST_MEAN and self.difference.max() <= MOST_PIXEL:
            return ""
        rows, columns = self._edges
        return (
            f"{(self.means > MOST_MEAN).sum()} of {self.means.size} regions differ by more than "
            f"{MOST_MEAN} in the mean; the worst at x {columns[column]}, y {rows[row]} by "
            f"{self.means.max():.2f}; the worst pixel by {self.difference.max()} "
            f"(at most {MOST_PIXEL})"
        )


def golden_picture(name: str) -> Picture:
    """The golden picture (H, W, 4) of a scene."""
    with Image.open(FOLDER / f"{name}.png") as image:
        return np.asarray(image.convert("RGBA"))


def save_golden(name: str, picture: Picture) -> None:
    """Make a picture the golden one."""
    opaque = bool((picture[..., 3] == 255).all())
    Image.fromarray(picture[..., :3] if opaque else picture).save(
        FOLDER / f"{name}.png", optimize=True
    )


def assert_like_golden(name: str, picture: Picture, folder: Path) -> None:
    """Fail, and save golden, drawn and difference side by side, where a picture is another."""
    golden = golden_picture(name)
    comparison = Comparison.of(picture, golden)
    if comparison.fault:
        path = folder / f"{name}-difference.png"
        amplified = np.minimum(comparison.difference * AMPLIFIED, 255).astype(np.uint8)
        grey = np.dstack([amplified] * 3 + [np.full_like(amplified, 255)])
        Image.fromarray(np.hstack([golden, picture, grey])).save(path)
        raise AssertionError(f"{name}: {comparison.fault}; golden, drawn and difference: {path}")
