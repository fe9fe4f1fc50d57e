"""Decode skelecaster's datagrams: the bodies of a Kinect v2, binary, little-endian.

Source: jaz303/skelecaster, README: packet format. Metres in the camera's axes; no time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.kinect.joints import CONFIDENCE_OF_STATE

Array = NDArray[np.float64]

HEAD = b"\x01\x01\x02"
_BODY = np.dtype([("id", "<u8"), ("positions", "<f4", (25, 3)), ("states", "u1", 25)])


@dataclass(frozen=True, slots=True, eq=False)
class CastBody:
    """A body: its id, positions (25, 3) [m] in camera axes, confidence (25,) in [0, 1]."""

    id: int
    positions: Array
    confidence: Array


def read_bodies(data: bytes) -> list[CastBody] | None:
    """Return the bodies in a datagram; None if it is another one, or its length is wrong."""
    if data[:3] != HEAD or len(data) < 4 or len(data) != 4 + data[3] * _BODY.itemsize:
        return None
    bodies = np.frombuffer(data, _BODY, offset=4)
    known = bodies["states"] < len(CONFIDENCE_OF_STATE)
    confidence = np.where(known, CONFIDENCE_OF_STATE[np.where(known, bodies["states"], 0)], 0.0)
    return [
        CastBody(int(body["id"]), body["positions"].astype(np.float64), sure)
        for body, sure in zip(bodies, confidence, strict=True)
    ]
