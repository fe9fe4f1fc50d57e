"""A page is a sheet; a body is none, nor is a flat figure cut out along its limbs."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.characters.open_character import load_character
from runtime.characters.sheet import is_sheet
from tests.runtime.stick_figures import make_figure


def grid(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """A flat sheet of squares."""
    y, x = np.divmod(np.arange(width * height), width)
    vertices = np.stack([x, y, np.zeros(len(x))], axis=1).astype(np.float64)
    a = np.arange(width * height).reshape(height, width)[:-1, :-1].ravel()
    faces = np.concatenate(
        [np.stack([a, a + 1, a + width + 1], 1), np.stack([a, a + width + 1, a + width], 1)]
    )
    return vertices, faces


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_flat_page_is_a_sheet_whichever_way_it_lies(axis: int) -> None:
    vertices, faces = grid(8, 12)
    assert is_sheet(np.roll(vertices, axis, axis=1), faces)


def test_a_flat_cross_is_a_figure() -> None:
    vertices, faces = grid(13, 13)
    middle = vertices[faces].mean(axis=1)
    arms = (np.abs(middle[:, 0] - 6.0) < 1.5) | (np.abs(middle[:, 1] - 6.0) < 1.5)
    assert not is_sheet(vertices, faces[arms])


def test_a_solid_body_is_no_sheet() -> None:
    figure = make_figure()
    assert not is_sheet(figure.vertices, figure.faces)


def test_the_page_of_the_stage_has_no_limbs_of_its_own() -> None:
    assert load_character("paper").plan is None
    assert load_character("mannequin").plan is not None
