"""Shared fixtures: where the real recordings and meshes lie, and a strict floating-point state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

SHARED = Path(__file__).resolve().parents[1].parent / "shared" / "data"


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real recordings and meshes beside the project; skips where it is absent."""
    if not SHARED.is_dir():
        pytest.skip(f"needs the real recordings and meshes in {SHARED}, which are not here")
    return SHARED


@pytest.fixture(autouse=True)
def _seeded() -> None:
    np.random.seed(0)
