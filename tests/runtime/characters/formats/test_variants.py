"""Meshes as other programs write them: PLY colours and strips, OFF on any lines."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from runtime.characters.formats.mesh_file import read_mesh_file
from runtime.characters.palette import linear_from_srgb

SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
ORANGE = (255, 128, 64)


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def ply(properties: str, colour: str, *, of_faces: bool = False) -> str:
    named = "".join(f"property {kind}\n" for kind in properties.split(", "))
    head = "ply\nformat ascii 1.0\nelement vertex 4\n"
    head += "property float x\nproperty float y\nproperty float z\n" + ("" if of_faces else named)
    head += "element face 1\nproperty list uchar int vertex_indices\n" + (named if of_faces else "")
    rows = [f"{row} {'' if of_faces else colour}" for row in SQUARE.splitlines()]
    return head + "end_header\n" + "\n".join(rows) + f"\n4 0 1 2 3 {colour if of_faces else ''}\n"


@pytest.mark.parametrize("of_faces", [False, True])
@pytest.mark.parametrize(
    ("properties", "colour"),
    [
        ("uchar red, uchar green, uchar blue", "255 128 64"),
        ("uchar r, uchar g, uchar b, uchar a", "255 128 64 255"),
        ("uchar diffuse_red, uchar diffuse_green, uchar diffuse_blue", "255 128 64"),
        ("float red, float green, float blue", "1 0.50196 0.25098"),
        ("uchar Red, uchar Green, uchar Blue", "255 128 64"),
    ],
)
def test_colours_of_a_ply_by_any_name(
    properties: str, colour: str, of_faces: bool, tmp_path: Path
) -> None:
    mesh = read_mesh_file(written(tmp_path, "a.ply", ply(properties, colour, of_faces=of_faces)))
    assert mesh.colors is not None
    expected = linear_from_srgb(np.array([ORANGE]) / 255.0)[0, :3]
    np.testing.assert_allclose(mesh.colors[:, :3], np.tile(expected, (4, 1)), atol=1e-4)


@pytest.mark.parametrize("binary", [False, True])
def test_strips_of_a_ply_are_triangles_that_face_one_way(binary: bool, tmp_path: Path) -> None:
    places = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (2, 0, 0), (2, 1, 0)]
    strip = [1, 0, 3, 2, -1, 3, 2, 5, 4]
    head = "ply\nformat {} 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
    head += "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
    head += "end_header\n"
    if binary:
        content = head.format("binary_little_endian").encode()
        content += b"".join(struct.pack("<3f", *place) for place in places)
        content += struct.pack("<10i", 9, *strip)
    else:
        rows = [" ".join(map(str, row)) for row in [*places, (9, *strip)]]
        content = (head.format("ascii") + "\n".join(rows) + "\n").encode()
    mesh = read_mesh_file(written(tmp_path, "a.ply", content))
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], [1.0] * 4)


OFF = "4 1 0\n" + SQUARE + "4 0 1 2 3\n"


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n" + OFF,
        "OFF" + OFF,
        "OFF " + OFF,
        "off\n" + OFF,
        "Off" + OFF,
        "OFF\n4\n1\n0\n" + OFF.split("\n", 1)[1],
        "OFF\n" + OFF.replace("\n", " "),
        "OFF 4 1 0 0 0 0 1\n0 0 1 1 0\n0 1 0 4\n0 1\n2 3",
        "OFF\n4 1 0\n0\n0\n0\n1\n0\n0\n1\n1\n0\n0\n1\n0\n4\n0\n1\n2\n3\n",
        "noff\n4 1 0\n" + SQUARE.replace("\n", " 0 0 1\n") + "4 0 1 2 3\n",
    ],
)
def test_an_off_on_any_lines(text: str, tmp_path: Path) -> None:
    mesh = read_mesh_file(written(tmp_path, "a.off", text))
    np.testing.assert_allclose(mesh.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert len(mesh.faces) == 2


@pytest.mark.parametrize("text", ["OFFER\n" + OFF, "OFF\n4 1 0\n0 0 0\n1 0 0\n", "OFF4"])
def test_what_is_no_off_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read_mesh_file(written(tmp_path, "a.off", text))
