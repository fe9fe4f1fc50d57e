"""What is done to a picture before it leaves: premultiplied, on black, fitted to a size."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from runtime.output.pictures import fitted, on_black, premultiplied

RED, BLUE, CLEAR = (250, 20, 10, 255), (10, 40, 240, 255), (0, 0, 0, 0)


@given(st.integers(0, 255), st.integers(0, 255))
def test_on_black_is_the_rounded_product(colour: int, alpha: int) -> None:
    one = np.array([[[colour, 255, 0, alpha]]], np.uint8)
    expected = [round(colour * alpha / 255), alpha, 0]
    assert on_black(one)[0, 0].tolist() == expected
    assert premultiplied(one)[0, 0].tolist() == [*expected, alpha]


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 40), st.integers(1, 40))
def test_what_fits_is_whole_in_the_middle_with_the_background_beside_it(
    width: int, height: int, to_width: int, to_height: int
) -> None:
    shown = np.full((height, width, 4), CLEAR, np.uint8)
    fits = fitted(shown, (to_width, to_height))
    assert fits.shape == (to_height, to_width, 4)
    assert fits.flags.writeable
    assert not fits.any()
    shown[:] = (0, 255, 0, 255)
    assert (fitted(shown, (to_width, to_height)) == (0, 255, 0, 255)).all()


def test_a_wide_picture_keeps_its_shape_in_a_tall_frame() -> None:
    shown = np.full((10, 20, 4), RED, np.uint8)
    shown[:, :2] = shown[:, -2:] = BLUE  # a frame, whose colour goes on
    shown[:2] = shown[-2:] = BLUE
    fits = fitted(shown, (20, 40))
    assert (fits[:15] == BLUE).all()
    assert (fits[25:] == BLUE).all()
    np.testing.assert_array_equal(fits[15:25], shown)
