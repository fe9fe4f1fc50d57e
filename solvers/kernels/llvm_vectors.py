"""The vectors of `solvers.kernels.vectors` as a numba type that LLVM keeps in registers.

Numba leaves it to LLVM to find loops that can be done several numbers at a time. LLVM finds none
where the numbers are gathered, or where it cannot know that a store leaves the next load alone. A
value of LLVM's own vector type states it. LLVM fits any length to any processor. The module uses
parts of numba that are not public.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.datamodel import models
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, register_model

_FAST = ("contract", "nsz")  # a product and a sum may be rounded at once
_PLACE, _LANE = ir.IntType(64), ir.IntType(32)


def _in_kernels(function: Callable[..., Any]) -> Any:
    """Let kernels call a function that returns a signature and a generator of LLVM code."""
    return intrinsic(prefer_literal=True)(function)


class Vector(types.Type):
    """The type of a vector of `lanes` numbers.

    It supports +, - and *, with another of the same type or with one number, which is rounded to
    the vector's precision.
    """

    def __init__(self, number: types.Float, lanes: int) -> None:
        self.number, self.lanes = number, lanes
        super().__init__(f"Vector({number}, {lanes})")


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, vector: Vector) -> None:
        number = manager.lookup(vector.number).get_value_type()
        super().__init__(manager, vector, ir.VectorType(number, vector.lanes))  # type: ignore[no-untyped-call]  # numba's


def _register(operation: Callable[..., Any], instruction: str) -> None:
    """Give kernels an operation of two vectors, or of a vector and a number."""

    @infer_global(operation)
    class _Typing(AbstractTemplate):
        def generic(self, args: Any, _: Any) -> Any:
            vector, other = args
            if isinstance(vector, Vector) and (other == vector or isinstance(other, types.Float)):
                return signature(vector, vector, other)
            return None

    def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        vector, other = values
        of_vector, of_other = signature.args
        if of_other != of_vector:
            number = context.cast(builder, other, of_other, of_vector.number)
            other = _spread(builder, number, vector.type)
        return getattr(builder, instruction)(vector, other, flags=_FAST)

    lower_builtin(operation, Vector, Vector)(lower)
    lower_builtin(operation, Vector, types.Float)(lower)


_register(operator.add, "fadd")
_register(operator.iadd, "fadd")
_register(operator.sub, "fsub")
_register(operator.isub, "fsub")
_register(operator.mul, "fmul")


def _spread(builder: Any, number: Any, kind: Any) -> Any:
    """An LLVM vector of equal numbers."""
    nothing = kind(ir.Undefined)
    first = builder.insert_element(nothing, number, _LANE(0))
    return builder.shuffle_vector(first, nothing, ir.VectorType(_LANE, kind.count)(None))


def _pointer(context: Any, builder: Any, array: tuple[Any, Any], at: Any, kind: Any) -> Any:
    """The address of a vector in an array, which is given as its type and its value."""
    data = context.make_array(array[0])(context, builder, array[1]).data
    return builder.bitcast(builder.gep(data, [at]), kind.as_pointer())


@_in_kernels
def zeros(_: Any, array: Any, lanes: Any) -> Any:
    """`zeros(array, lanes)`: zeros of the array's type."""
    vector = Vector(array.dtype, lanes.literal_value)

    def generate(context: Any, *_: Any) -> Any:
        return context.get_value_type(vector)(None)

    return vector(array, lanes), generate


@_in_kernels
def load(_: Any, array: Any, at: Any, lanes: Any) -> Any:
    """`load(array, at, lanes)`: numbers of a contiguous array, from place `at` of its memory."""
    vector = Vector(array.dtype, lanes.literal_value)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kind = context.get_value_type(vector)
        pointer = _pointer(context, builder, (array, values[0]), values[1], kind)
        return builder.load(pointer, align=context.get_abi_sizeof(kind.element))

    return vector(array, types.int64, lanes), generate


@_in_kernels
def store(_: Any, vector: Any, array: Any, at: Any) -> Any:
    """`store(vector, array, at)`: put a vector into a contiguous array at place `at`."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kind = values[0].type
        pointer = _pointer(context, builder, (array, values[1]), values[2], kind)
        builder.store(values[0], pointer, align=context.get_abi_sizeof(kind.element))
        return context.get_dummy_value()

    return types.void(vector, array, types.int64), generate


@_in_kernels
def load_row(_: Any, array: Any, i: Any) -> Any:
    """`load_row(array, i)`: row i of an array (n, 3) and a zero; memory beyond is not read."""
    vector = Vector(array.dtype, 4)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        number = context.get_value_type(array.dtype)
        pair, size = ir.VectorType(number, 2), context.get_abi_sizeof(number)
        at = builder.mul(values[1], _PLACE(3))
        pointer = _pointer(context, builder, (array, values[0]), at, pair)
        front = builder.load(pointer, align=size)
        third = builder.load(
            builder.gep(builder.bitcast(pointer, number.as_pointer()), [_PLACE(2)])
        )
        back = builder.insert_element(pair(None), third, _LANE(0))
        return builder.shuffle_vector(front, back, ir.VectorType(_LANE, 4)([0, 1, 2, 3]))

    return vector(array, types.int64), generate


@_in_kernels
def repeat_three(_: Any, vector: Any) -> Any:
    """`repeat_three(v)`: the first three of four numbers, repeated to eight."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        lanes = ir.VectorType(_LANE, 8)([0, 1, 2, 0, 1, 2, 0, 1])
        return builder.shuffle_vector(values[0], values[0], lanes)

    return Vector(vector.number, 8)(vector), generate


@_in_kernels
def lane(_: Any, vector: Any, i: Any) -> Any:
    """`lane(v, i)`: number i of a vector; i is a constant."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.extract_element(values[0], _LANE(i.literal_value))

    return vector.number(vector, i), generate
