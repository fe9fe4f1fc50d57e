"""Tests of states: whether they are immutable, share nothing, and say the same as others."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

IMMUTABLE = (bool, int, float, str, bytes, type(None), np.dtype, np.generic, type)


def leaves(value: object, at: str = "state") -> Iterator[tuple[str, Any]]:
    """Everything in a state that is not a frozen dataclass or a tuple, and where it is.

    Raises:
        AssertionError: something in it can be changed, and is no array.
    """
    if is_dataclass(value) and not isinstance(value, type):
        assert value.__dataclass_params__.frozen, f"{at} is a {type(value).__name__}, not frozen"
        for each in fields(value):
            yield from leaves(getattr(value, each.name), f"{at}.{each.name}")
    elif isinstance(value, tuple | frozenset):
        for number, each in enumerate(value):
            yield from leaves(each, f"{at}[{number}]")
    else:
        assert isinstance(value, (np.ndarray, *IMMUTABLE)), f"{at} is a {type(value).__name__}"
        yield at, value


def arrays(value: object) -> list[NDArray]:
    """All arrays of a state."""
    return [leaf for _, leaf in leaves(value) if isinstance(leaf, np.ndarray)]


def size(value: object) -> int:
    """Bytes of a state's arrays."""
    return sum(array.nbytes for array in arrays(value))


def digest(value: object) -> str:
    """A hash of all that a state says: equal for states of the same bytes."""
    out = hashlib.sha256()
    for at, leaf in leaves(value):
        if isinstance(leaf, np.ndarray):
            out.update(f"{at} {leaf.dtype} {leaf.shape} ".encode())
            for field in leaf.dtype.names or [()]:  # not the padding between fields
                out.update(leaf[field].tobytes())
        else:
            out.update(f"{at} {leaf!r} ".encode())
    return out.hexdigest()
