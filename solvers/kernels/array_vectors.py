"""Small arrays in place of `llvm_vectors`, if numba's internals changed: same answers, slower."""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.kernels.compiled import kernel


@kernel
def zeros(array: Any, lanes: int) -> Any:
    """Zeros of the array's type."""
    return np.zeros(lanes, array.dtype)


@kernel
def load(array: Any, at: int, lanes: int) -> Any:
    """Numbers of a contiguous array, from place `at` of its memory."""
    numbers = np.empty(lanes, array.dtype)
    memory = array.reshape(array.size)
    for i in range(lanes):
        numbers[i] = memory[np.int64(at) + i]
    return numbers


@kernel
def store(vector: Any, array: Any, at: int) -> None:
    """Put a vector into a contiguous array at place `at`."""
    memory = array.reshape(array.size)
    for i in range(len(vector)):
        memory[np.int64(at) + i] = vector[i]


@kernel
def load_row(array: Any, i: int) -> Any:
    """Row i of an array (n, 3) and a zero."""
    numbers = np.zeros(4, array.dtype)
    for axis in range(3):
        numbers[axis] = array[i, axis]
    return numbers


@kernel
def repeat_three(vector: Any) -> Any:
    """The first three of four numbers, repeated to eight."""
    numbers = np.empty(8, vector.dtype)
    for i in range(8):
        numbers[i] = vector[i % 3]
    return numbers


@kernel
def lane(vector: Any, i: int) -> Any:
    """Number i of a vector."""
    return vector[i]
