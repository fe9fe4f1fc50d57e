"""Hides joints that a tracker only guesses, such as legs below the edge of a webcam's picture.

MediaPipe gives every joint a place, also those outside the picture: it invents a pose for legs, and
says that they are hardly visible. Performed, they let a character stand on one leg.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GUESSED = 0.1
"""The confidence below which a joint is a guess.

In a recording of MediaPipe, hips at the edge of the picture and hidden hands have 0.12 to 0.6, legs
outside it at most 0.02.
"""

SURE = 0.5
"""The confidence of the surest joint below which a frame's confidences say nothing."""


def seen_only(positions: Array, confidence: Array) -> Array:
    """Return joints (J, 3) [m] with NaN for those that are guessed.

    Args:
        positions: (J, 3) [m]; NaN where a joint was not seen.
        confidence: (J,) 0 to 1, by the tracker.
    """
    if confidence.max(initial=0.0) < SURE:
        return positions
    guessed = confidence < GUESSED
    return np.where(guessed[:, None], np.nan, positions) if guessed.any() else positions
