"""The processor that kernels are compiled for.

A checkout compiles for the processor at hand. A compiled wheel (`scripts/compiled_wheel.py`) comes
with machine code for x86-64-v3, which every processor of the last ten years runs. Numba looks only
for machine code of the processor that it compiles for, so it must be set before numba is imported.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

PACKED = Path(__file__).parent / "machine_code"
"""Machine code that came with the program; a checkout has none."""

NAME = "x86-64-v3"
_FEATURES = "avx avx2 bmi bmi2 cx16 f16c fma lzcnt movbe popcnt sse4.2 xsave".split()


def choose_processor() -> None:
    """Compile for the processor of the packed machine code, where there is any and it runs here."""
    names = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")
    if not PACKED.is_dir() or "numba" in sys.modules or any(name in os.environ for name in names):
        return
    if runs_packed(_host_features()):
        os.environ.update(zip(names, (NAME, ""), strict=True))


def runs_packed(features: Mapping[str, bool]) -> bool:
    """Whether a processor with these features, as LLVM names them, runs x86-64-v3."""
    return all(features.get(name, False) for name in _FEATURES)


def _host_features() -> Mapping[str, bool]:
    from llvmlite.binding import get_host_cpu_features  # noqa: PLC0415  # for compiled wheels only

    try:
        features: Mapping[str, bool] = get_host_cpu_features()
    except RuntimeError:  # LLVM does not know this kind of processor
        return {}
    return features
