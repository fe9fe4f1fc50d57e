"""The camera: framing boxes, orbiting, panning and zooming."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from runtime.render.camera import HIGHEST_PITCH, Camera, box_corners, front_camera

finite = st.floats(-5.0, 5.0, allow_nan=False)
length = st.floats(0.05, 4.0)
angle = st.floats(-3.0, 3.0)


def on_screen(camera: Camera, points: np.ndarray, aspect: float) -> np.ndarray:
    """Where points (N, 3) fall, from -1 to 1 across and up the picture, and their depth."""
    clip = (
        np.column_stack([points, np.ones(len(points))])
        @ (camera.projection(aspect) @ camera.view).T
    )
    return clip[:, :3] / clip[:, 3:]


def test_a_level_camera_sees_a_square_at_the_closed_form_distance() -> None:
    camera = Camera(eye=(0, 0, 3), target=(0, 0, 0), fov=math.radians(90))
    framed = camera.frame([[-1, -1, 0], [1, 1, 0]], aspect=1.0, margin=0.0)
    np.testing.assert_allclose(framed.eye, (0, 0, 1.0), atol=1e-12)  # half size / tan(45 deg)
    np.testing.assert_allclose(framed.target, (0, 0, 0), atol=1e-12)


def test_a_margin_moves_the_camera_away_by_its_share() -> None:
    camera = Camera(eye=(0, 0, 3), target=(0, 0, 0), fov=math.radians(90))
    framed = camera.frame([[-1, -1, 0], [1, 1, 0]], aspect=1.0, margin=0.25)
    np.testing.assert_allclose(framed.distance, 2.0)  # the square fills half of the picture


@given(
    low=st.tuples(finite, finite, finite),
    size=st.tuples(length, length, length),
    yaw=angle,
    pitch=st.floats(0.0, 1.2),
    aspect=st.floats(0.4, 3.0),
    margin=st.floats(0.0, 0.3),
)
def test_boxes_touch_the_margin_and_never_cross_it(
    low: tuple[float, float, float],
    size: tuple[float, float, float],
    yaw: float,
    pitch: float,
    aspect: float,
    margin: float,
) -> None:
    bounds = np.array([low, np.add(low, size)])
    camera = front_camera().orbit(yaw, pitch).frame(bounds, aspect, margin=margin)
    seen = on_screen(camera, box_corners(bounds[None]), aspect)
    free = 1.0 - 2.0 * margin
    assert np.abs(seen[:, :2]).max() <= free + 1e-6
    tightest = np.maximum(np.ptp(seen[:, 0]), np.ptp(seen[:, 1]))
    assert tightest > 0.5 * free  # it is not needlessly far
    assert seen[:, 2].max() < 1.0
    assert seen[:, 2].min() > -1.0


def test_several_boxes_are_framed_together() -> None:
    boxes = np.array([[[-3, 0, 0], [-2, 1, 1]], [[2, 0, 0], [3, 2, 1]]], dtype=float)
    seen = on_screen(front_camera().frame(boxes, 16 / 9), box_corners(boxes), 16 / 9)
    assert np.abs(seen[:, :2]).max() <= 0.8 + 1e-9
    assert seen[:, 0].min() < -0.75
    assert seen[:, 0].max() > 0.75


def test_framing_does_not_turn_the_camera() -> None:
    camera = front_camera().orbit(0.7, 0.2)
    framed = camera.frame([[-1, 0, -1], [1, 2, 1]], 1.5)
    np.testing.assert_allclose(framed.view_rotation, camera.view_rotation, atol=1e-12)


@given(yaw=angle, pitch=angle)
def test_the_view_is_a_rotation_that_keeps_the_eye_above_the_floor(
    yaw: float, pitch: float
) -> None:
    camera = front_camera().orbit(yaw, pitch)
    rotation = camera.view_rotation
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert camera.eye[1] > camera.target[1]
    assert rotation[2, 1] <= math.sin(HIGHEST_PITCH) + 1e-9
    assert camera.distance == pytest.approx(front_camera().distance)


def test_the_front_camera_has_the_performers_left_hand_on_the_right() -> None:
    seen = on_screen(front_camera(), np.array([[0.5, 1.0, 0.0]]), 1.0)  # left is +X, facing +Z
    assert seen[0, 0] > 0.0


def test_pan_shifts_the_target_across_the_picture_and_zoom_brings_it_closer() -> None:
    camera = front_camera()
    moved = camera.pan(0.25, 0.0)
    seen = on_screen(moved, np.array([camera.target]), 1.0)
    np.testing.assert_allclose(seen[0, :2], (-0.5, 0.0), atol=1e-9)
    assert camera.zoom(2.0).distance == pytest.approx(camera.distance / 2.0)
    np.testing.assert_allclose(camera.zoom(2.0).target, camera.target)
