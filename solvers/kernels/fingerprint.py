"""A hash of everything that a kernel's machine code depends on.

Numba copies the kernels that a kernel calls into its machine code, and the values of the globals
that it names. Its own cache compares the file of the kernel alone, so it keeps machine code of
which a part has changed. This hash follows the calls instead: bytecode, constants, globals,
compile options and the fields of named tuples, through all kernels that are reached. Docstrings,
comments and line numbers are not in it: they do not change machine code.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numpy as np
from numba.core import types
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic


def source_fingerprint(kernel: Dispatcher) -> str:
    """The hash of a kernel's source and of all that it reaches."""
    reached = [kernel]
    digest = hashlib.sha256()
    for each in reached:  # grows while it is read
        own, callees = _own(each)
        digest.update(own)
        reached += [callee for callee in callees if callee not in reached]
    return digest.hexdigest()


def signature_fingerprint(arguments: tuple[Any, ...]) -> str:
    """The argument types, with the fields of named tuples in their order."""
    return "; ".join(_described_type(argument) for argument in arguments)


@cache
def _own(kernel: Dispatcher) -> tuple[bytes, tuple[Dispatcher, ...]]:
    """The hash of a kernel without its callees, and the callees."""
    callees: dict[Dispatcher, None] = {}
    parts = [*_parts(kernel.py_func, callees), *sorted(_options(kernel))]
    return hashlib.sha256("\n".join(parts).encode()).digest(), tuple(callees)


def _options(kernel: Dispatcher) -> Iterator[str]:
    for name, value in kernel.targetoptions.items():
        yield f"{name}={sorted(value) if isinstance(value, (set, frozenset)) else value}"


def _described_type(kind: Any) -> str:
    if not isinstance(kind, types.BaseTuple):
        return str(kind)
    as_tuple: Any = kind  # numba's types do not state what its tuples have
    members = ", ".join(_described_type(member) for member in as_tuple)
    if isinstance(kind, types.BaseNamedTuple):
        return f"{_described_class(as_tuple.instance_class)}({members})"
    return f"{type(kind).__name__}({members})"


def _described_class(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}{getattr(kind, '_fields', '')}"


def _parts(function: Any, callees: dict[Dispatcher, None]) -> Iterator[str]:
    """A function's bytecode and the globals that it names; kernels are added to `callees`."""
    yield f"{function.__module__}.{function.__qualname__} {function.__defaults__}"
    names: dict[str, None] = {}
    yield from _code_parts(function.__code__, function.__doc__, names)
    for name in names:
        if name in function.__globals__:
            yield f"{name}: {_described(function.__globals__[name], tuple(names), callees)}"
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield f"{name}: {_described(cell.cell_contents, tuple(names), callees)}"


def _code_parts(code: CodeType, doc: str | None, names: dict[str, None]) -> Iterator[str]:
    yield f"{code.co_code.hex()} {code.co_varnames[: code.co_argcount]} {code.co_names}"
    names.update(dict.fromkeys(code.co_names))
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code_parts(constant, None, names)
        elif doc is None or constant != doc:
            yield repr(constant)


def _described(value: Any, names: tuple[str, ...], callees: dict[Dispatcher, None]) -> str:
    """One global or closure value; what cannot be described has an address, and is never cached."""
    if isinstance(value, Dispatcher):
        callees[value] = None
        return f"kernel {value.py_func.__module__}.{value.py_func.__qualname__}"
    if isinstance(value, _Intrinsic):
        return f"{value._defn.__qualname__} in {_source_hash(inspect.getfile(value._defn))}"
    if isinstance(value, ModuleType):
        return f"module {value.__name__} {_described_members(value, names, callees)}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if callable(value) and not isinstance(value, types.Type):
        return _described_callable(value)
    return repr(value)


def _described_members(
    module: ModuleType, names: tuple[str, ...], callees: dict[Dispatcher, None]
) -> list[str]:
    named = {name: vars(module)[name] for name in names if name in vars(module)}
    return [
        f"{name}: {_described(member, names, callees)}"
        for name, member in named.items()
        if not isinstance(member, ModuleType)
    ]


def _described_callable(value: Any) -> str:
    if isinstance(value, type):
        return _described_class(value)
    name = getattr(value, "__qualname__", getattr(value, "__name__", repr(value)))
    return f"{getattr(value, '__module__', '')}.{name}"


@cache
def _source_hash(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()
