"""Picking: rays and places on the screen are the camera's, and the nearest polyline is found."""

from __future__ import annotations

import math

import numpy as np
import pytest

from runtime.render.camera import Camera, front_camera
from runtime.render.picking import nearest_polyline, on_screen, ray_through

SIZE = (640, 360)
CAMERAS = [
    front_camera(),
    front_camera().orbit(0.7, 0.4).zoom(1.4),
    front_camera().clear_of(0.3, 0.0, 0.1, 0.2),
    Camera(eye=(3.0, 2.0, 1.0), target=(0.5, 0.4, -0.2), shift=(0.2, -0.3)),
]


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_point_lies_on_the_ray_through_its_place_on_the_screen(camera: Camera) -> None:
    points = np.random.default_rng(0).uniform(-0.6, 1.2, (50, 3))
    for point, at in zip(points, on_screen(camera, SIZE, points), strict=True):
        origin, direction = ray_through(camera, SIZE, tuple(at))
        along = (point - origin) @ direction / (direction @ direction)
        assert along > 0.0
        np.testing.assert_allclose(origin + along * direction, point, atol=1e-9)


def test_the_middle_of_the_picture_is_what_the_camera_looks_at() -> None:
    camera = front_camera()
    np.testing.assert_allclose(on_screen(camera, SIZE, [camera.target]), [(320.0, 180.0)])
    _, direction = ray_through(camera, SIZE, (320.0, 180.0))
    looks = np.subtract(camera.target, camera.eye) / camera.distance
    np.testing.assert_allclose(direction, looks, atol=1e-12)


def test_right_is_right_and_down_is_down() -> None:
    camera = front_camera(pitch=0.0)
    edge = 2.0 * camera.distance * math.tan(camera.fov / 2.0) / 2.0  # half the picture's height
    x, y, z = camera.target
    places = on_screen(camera, SIZE, [(x + edge, y, z), (x, y + edge, z)])
    np.testing.assert_allclose(places, [(500.0, 180.0), (320.0, 0.0)], atol=1e-9)


def test_what_is_behind_the_camera_is_nowhere() -> None:
    camera = front_camera()
    behind = np.array(camera.eye) + 0.5 * np.subtract(camera.eye, camera.target)
    assert np.isnan(on_screen(camera, SIZE, [behind])).all()


def test_the_nearest_polyline_within_reach_is_found() -> None:
    level = np.array([(0.0, 0.0), (10.0, 0.0)])
    bent = np.array([(0.0, 8.0), (10.0, 8.0), (10.0, 20.0)])
    assert nearest_polyline((5.0, 3.0), [level, bent], 4.0) == 0
    assert nearest_polyline((5.0, 6.0), [level, bent], 4.0) == 1
    assert nearest_polyline((13.0, 15.0), [level, bent], 4.0) == 1
    assert nearest_polyline((13.0, 3.0), [level, bent], 3.0) is None, "beyond the end"
    assert nearest_polyline((5.0, 50.0), [level, bent], 4.0) is None
    gone = np.array([(5.0, 3.0), (math.nan, math.nan)])
    assert nearest_polyline((5.0, 3.0), [gone, level], 4.0) == 1
