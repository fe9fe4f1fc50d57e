"""Fixtures of all tests: real recordings, a GL context, a seed, Ctrl-C; options and profiles."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from devices.errors import InputError
from runtime.render.context import headless_context, release_headless
from tests.thorough import examples

# Nothing may depend on the clock: how long an example takes is no fault.
settings.register_profile(
    "bunraku",
    deadline=None,
    max_examples=examples(100),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("bunraku")

SHARED = Path(__file__).resolve().parents[1].parent / "shared" / "data"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of our own tests."""
    parser.addoption(
        "--regenerate-golden", action="store_true", help="draw the golden pictures anew"
    )


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real recordings and meshes beside the project; skips where it is absent."""
    if not SHARED.is_dir():
        pytest.skip(f"needs the real recordings and meshes in {SHARED}, which are not here")
    return SHARED


@pytest.fixture(scope="module")
def context() -> Iterator[moderngl.Context]:
    """A GL context without a screen; skips where there can be none."""
    try:
        context = headless_context()
    except InputError as error:
        pytest.skip(str(error))
    yield context
    release_headless(context)


@pytest.fixture(autouse=True)
def _seeded() -> None:
    np.random.seed(0)


@pytest.fixture(autouse=True, scope="session")
def _heard() -> Iterator[None]:
    """Programs that tests start hear Ctrl-C, also where the tests run behind `&` or `nohup`."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
