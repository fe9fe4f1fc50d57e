"""Dense matrices laid out so that three row vectors times one run at the processor's full speed.

A matrix is cut into panels of WIDE columns, the last one of NARROW where that is enough; within a
panel, row follows row. Three vectors times a panel are three sums of its rows, which stay in three
registers from the first row to the last.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.vectors import load, store, zeros
from solvers.linear.laplacian import Floats

Indices = NDArray[np.int32]
Offsets = NDArray[np.int64]
Singles = NDArray[np.float32]

WIDE, NARROW = 16, 8  # single precision numbers in a register of AVX-512, and of AVX


def panels_size(rows: Offsets, columns: Offsets) -> Offsets:
    """How many numbers the panels of matrices (rows, columns) take."""
    return rows * (-(-columns // NARROW) * NARROW)


@kernel
def lay_panels(matrix: Floats, panels: Singles) -> None:
    """Copy a matrix into panels that are zero."""
    rows, columns = matrix.shape
    at = 0
    for low in range(0, columns, WIDE):
        width = WIDE if columns - low > NARROW else NARROW
        for row in range(rows):
            for column in range(low, min(low + width, columns)):
                panels[at + column - low] = matrix[row, column]
            at += width


def _product(width: int) -> Callable[..., None]:
    """Make the product of three vectors with one panel of so many columns."""

    @kernel
    def product(  # noqa: PLR0917
        panels: Singles,
        at: int,
        vectors: Singles,
        picked: Indices,
        begin: int,
        end: int,
        sums: Singles,
        low: int,
    ) -> None:
        x, y, z = zeros(panels, width), zeros(panels, width), zeros(panels, width)
        for h in range(begin, end):
            row, v = load(panels, at, width), np.uint64(picked[h])
            x += row * vectors[v, 0]
            y += row * vectors[v, 1]
            z += row * vectors[v, 2]
            at += width
        stride = sums.shape[1]
        store(x, sums, low)
        store(y, sums, stride + low)
        store(z, sums, 2 * stride + low)

    return product


_wide_product, _narrow_product = _product(WIDE), _product(NARROW)


@kernel
def multiply(  # noqa: PLR0917
    panels: Singles,
    at: int,
    columns: int,
    vectors: Singles,
    picked: Indices,
    begin: int,
    end: int,
    sums: Singles,
) -> None:
    """Three vectors times the matrix of so many columns whose panels start at panels[at].

    The vectors are the rows of `vectors` (n, 3) named by picked[begin:end]; `sums` (3, s), with
    room for whole panels, becomes their products. All arrays but `picked` are of one type.
    """
    rows = end - begin
    for low in range(0, columns, WIDE):
        if columns - low > NARROW:
            _wide_product(panels, at, vectors, picked, begin, end, sums, low)
            at += rows * WIDE
        else:
            _narrow_product(panels, at, vectors, picked, begin, end, sums, low)
            at += rows * NARROW
