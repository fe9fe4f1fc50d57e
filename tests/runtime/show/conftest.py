"""The scenes that a test opens are closed after it."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import pytest

from runtime.show.scene import Scene


@pytest.fixture
def scenes(context: moderngl.Context) -> Iterator[list[Scene]]:
    """Where a test puts the scenes that it opens."""
    opened: list[Scene] = []
    yield opened
    for scene in opened:
        scene.close()
    assert context.error == "GL_NO_ERROR"
