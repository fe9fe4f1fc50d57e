"""Dense matrices in panels, a layout for the product of three row vectors and a matrix.

A matrix is cut into panels of WIDE columns, the last one of NARROW where that is enough. Within a
panel, row follows row. Three vectors times a panel are three sums of its rows. The sums stay in
registers from the first row to the last, and memory is read in order.
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
    """The number of numbers in the panels of matrices (rows, columns)."""
    return rows * (-(-columns // NARROW) * NARROW)


@kernel
def lay_panels(matrix: Floats, panels: Singles) -> None:
    """Copy a matrix into its panels, which are zero before."""
    rows, columns = matrix.shape
    at = 0
    for low in range(0, columns, WIDE):
        width = WIDE if columns - low > NARROW else NARROW
        for row in range(rows):
            for column in range(low, min(low + width, columns)):
                panels[at + column - low] = matrix[row, column]
            at += width


def _product(width: int) -> Callable[..., None]:
    """Make the kernel that multiplies three vectors by one panel of `width` columns."""

    @kernel
    def product(
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
def multiply(
    panels: Singles,
    at: int,
    columns: int,
    vectors: Singles,
    picked: Indices,
    begin: int,
    end: int,
    sums: Singles,
) -> None:
    """Multiply three vectors by the matrix with `columns` columns whose panels start at panels[at].

    The vectors are the rows picked[begin:end] of `vectors` (n, 3). `sums` (3, s), which has room
    for whole panels, becomes the products. All arrays except `picked` have one number type.
    """
    rows = end - begin
    for low in range(0, columns, WIDE):
        if columns - low > NARROW:
            _wide_product(panels, at, vectors, picked, begin, end, sums, low)
            at += rows * WIDE
        else:
            _narrow_product(panels, at, vectors, picked, begin, end, sums, low)
            at += rows * NARROW
