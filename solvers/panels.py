"""Dense matrices laid out so that three row vectors times one run at the processor's full speed.

A matrix is cut into panels of WIDE columns, the last one of NARROW where that is enough; within a
panel, row follows row. Three vectors times a panel are three sums of rows, which should stay in
three registers from the first row to the last. Numba's loops would store and fetch them at every
row, so this one is spelled out in LLVM's vectors, which it fits to any processor.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from solvers.compiled import kernel
from solvers.laplacian import Floats

Indices = NDArray[np.int32]
Offsets = NDArray[np.int64]
Singles = NDArray[np.float32]

WIDE, NARROW = 16, 8  # single precision numbers in a register of AVX-512, and of AVX

_FUSED = ("contract",)  # a product and a sum may be rounded at once


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
    """The product of three vectors with the panel of `width` columns that starts at panels[at].

    Row d of `sums`, from column `low` on, becomes the sum over i of vectors[picked[begin + i], d]
    times row i of the panel.
    """

    @intrinsic
    def product(_, panels, at, vectors, picked, begin, end, sums, low):  # type: ignore[no-untyped-def] # noqa: PLR0917
        place = types.int64
        taken = types.void(panels, place, vectors, picked, place, place, sums, place)
        return taken, partial(_emit_product, width)

    emitted: Callable[..., None] = product
    return emitted


def _emit_product(width: int, context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Write what `_product` promises in LLVM's language."""
    panels, vectors, picked, sums = (
        context.make_array(signature.args[h])(context, builder, values[h]) for h in (0, 2, 3, 6)
    )
    at, begin, end, low = (values[h] for h in (1, 4, 5, 7))
    number = context.get_value_type(signature.args[0].dtype)
    alignment = context.get_abi_sizeof(number)
    row_type = ir.VectorType(number, width)
    place = ir.IntType(64)

    def row_at(array: Any, offset: Any) -> Any:
        return builder.bitcast(builder.gep(array.data, [offset]), row_type.as_pointer())

    totals = [cgutils.alloca_once_value(builder, row_type(None)) for _ in range(3)]  # type: ignore[no-untyped-call]
    with cgutils.for_range_slice(builder, begin, end, place(1), place) as (i, _):
        offset = builder.add(at, builder.mul(builder.sub(i, begin), place(width)))
        row = builder.load(row_at(panels, offset), align=alignment)
        vertex = builder.zext(builder.load(builder.gep(picked.data, [i])), place)
        first = builder.mul(vertex, place(3))
        for d, total in enumerate(totals):
            factor = builder.load(builder.gep(vectors.data, [builder.add(first, place(d))]))
            term = builder.fmul(row, _spread(builder, factor, row_type), flags=_FUSED)
            builder.store(builder.fadd(builder.load(total), term, flags=_FUSED), total)
    _, stride = cgutils.unpack_tuple(builder, sums.shape)  # type: ignore[no-untyped-call]
    for d, total in enumerate(totals):
        offset = builder.add(low, builder.mul(stride, place(d)))
        builder.store(builder.load(total), row_at(sums, offset), align=alignment)
    return context.get_dummy_value()


def _spread(builder: Any, number: Any, row_type: Any) -> Any:
    """A row of equal numbers."""
    nothing, lane = row_type(ir.Undefined), ir.IntType(32)
    first = builder.insert_element(nothing, number, lane(0))
    everywhere = ir.VectorType(lane, row_type.count)(None)
    return builder.shuffle_vector(first, nothing, everywhere)


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
