"""Machine code of kernels on disk, found by a hash of everything that it depends on.

One file holds one kernel for one list of argument types. Its name is the hash, so a file is never
out of date, checkouts with the same kernels share it, and two processes that write it at the same
time write the same.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

import llvmlite
import numba
import numpy as np
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.np.ufunc.parallel import _launch_threads

from solvers.kernels.fingerprint import signature_fingerprint, source_fingerprint
from solvers.kernels.processor import PACKED

KEPT = 30 * 24 * 3600.0  # [s] after its last use that a file is removed

SUFFIX = ".nbc"
_VERSIONS = (
    f"python {sys.version_info[:2]} numba {numba.__version__} llvmlite {llvmlite.__version__} "
    f"numpy {np.__version__.split('.')[0]}"
)


def cache_folder() -> Path:
    """The user's folder for data that can be computed again, by the custom of the platform."""
    home = Path(os.path.expanduser("~"))  # noqa: PTH111  # Path.home raises where there is none
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "bunraku"


FOLDER = cache_folder() / "kernels"
"""Where this program keeps machine code; fixed when the program starts."""

_kernels: list[Dispatcher] = []  # every kernel of the modules that are imported
_used: set[str] = set()  # names of the files that this process loaded or wrote


class KernelCache(NullCache):
    """The cache of one kernel; numba calls it before and after it compiles."""

    def __init__(self, kernel: Dispatcher) -> None:
        self._kernel = kernel
        self._folder = FOLDER
        _kernels.append(kernel)

    @property
    def cache_path(self) -> str:
        """The folder, as numba reports it."""
        return str(self._folder)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel for these argument types, or None. A damaged file counts as none."""
        target_context.refresh()
        name = self._name(sig, target_context.codegen())
        for path in (self._folder / name, PACKED / name):
            try:
                compiled = _read(path, target_context)
            except Exception:  # damaged files raise whatever their pickles say
                continue
            _touch(path)
            _used.add(name)
            return compiled
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel; a folder that cannot be written is no error."""
        if data.library.has_dynamic_globals:
            return  # it holds an address of this process
        name = self._name(sig, data.codegen)
        with suppress(OSError):
            _write(self._folder / name, dumps(data._reduce()))
            _used.add(name)

    def _name(self, sig: Any, codegen: Any) -> str:
        arguments, _ = normalize_signature(sig)
        key = hashlib.sha256(signature_fingerprint(arguments).encode()).hexdigest()[:16]
        return f"{_stem(self._kernel, codegen)}-{key}{SUFFIX}"


def _stem(kernel: Dispatcher, codegen: Any) -> str:
    """The first part of the names of a kernel's files, for any argument types."""
    made_from = (_VERSIONS, codegen.magic_tuple(), _source(kernel))
    key = hashlib.sha256(repr(made_from).encode()).hexdigest()[:16]
    function = kernel.py_func
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}-{key}"


def save_list(part: str, leave_out: str) -> None:
    """List the files that this process used, as everything that one part of the program needs."""
    with suppress(OSError):
        text = "\n".join(sorted(_used))
        _write(FOLDER / _list_name(part, leave_out), text.encode())


def has_list(part: str, leave_out: str) -> bool:
    """Whether all files that this part needs for the present kernels are there and intact.

    A power cut leaves files empty or full of zeros; they count as missing, like a damaged list.

    Args:
        part: a name.
        leave_out: the start of the names of modules whose kernels the part does not need.
    """
    name = _list_name(part, leave_out)
    for folder in (FOLDER, PACKED):
        with suppress(OSError, ValueError):  # a damaged list is no text, or holds no names
            listed = (folder / name).read_text(encoding="utf-8").split("\n")
            paths = [_found(each) for each in listed]
            if None not in paths:
                for path in (folder / name, *filter(None, paths)):
                    _touch(path)
                return True
    return False


def count_compiled(leave_out: str) -> tuple[int, int]:
    """How many kernels of the imported modules are in the user's folder, and of how many."""
    codegen = cpu_target.target_context.codegen()
    there = {path.name.rpartition("-")[0] for path in FOLDER.glob(f"*{SUFFIX}")}
    stems = [_stem(kernel, codegen) for kernel in _known(leave_out)]
    return sum(stem in there for stem in stems), len(stems)


def _known(leave_out: str) -> list[Dispatcher]:
    rooms = ("devices.", "replay.", "runtime.", "solvers.")
    modules = [(kernel, kernel.py_func.__module__) for kernel in _kernels]
    return [
        kernel
        for kernel, module in modules
        if module.startswith(rooms) and not module.startswith(leave_out)
    ]


def _list_name(part: str, leave_out: str) -> str:
    processor = cpu_target.target_context.codegen().magic_tuple()
    sources = sorted(_source(kernel) for kernel in _known(leave_out))
    key = hashlib.sha256(repr((_VERSIONS, processor, sources)).encode()).hexdigest()[:32]
    return f"{part}-{key}.list"


def _found(name: str) -> Path | None:
    paths = (FOLDER / name, PACKED / name)
    return next((path for path in paths if path.is_file() and _is_whole(path)), None)


def _is_whole(path: Path) -> bool:
    """Whether a file begins and ends as pickles do."""
    with path.open("rb") as file:
        first = file.read(1)
        file.seek(-len(first), os.SEEK_END)
        return (first, file.read(1)) == (pickle.PROTO, pickle.STOP)


def _touch(path: Path) -> None:
    with suppress(OSError):  # a folder of the system's
        os.utime(path)  # the time of the last use


def _write(path: Path, data: bytes) -> None:
    """Write beside, then rename: another process never sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{uuid4().hex}.part")
    part.write_bytes(data)
    part.replace(path)


def remove_unused(now: float | None = None) -> int:
    """Remove the files that no program used for `KEPT` seconds; return their number."""
    oldest = (time.time() if now is None else now) - KEPT
    removed = 0
    for path in FOLDER.glob("*"):
        with suppress(OSError):
            if path.stat().st_mtime < oldest:
                path.unlink()
                removed += 1
    return removed


@cache
def _source(kernel: Dispatcher) -> str:
    return source_fingerprint(kernel)


def _read(path: Path, target_context: Any) -> Any:
    data = pickle.loads(path.read_bytes())
    # Machine code names functions of numba's that exist only once its threads do.
    _launch_threads()
    return CompileResult._rebuild(target_context, *data)
