"""Mesh files of every format: the same surface, and one line for what is damaged."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import InputError
from runtime.characters.character_file import SUFFIXES, read_character
from runtime.characters.formats.mesh_data import FileMesh
from runtime.characters.formats.mesh_file import MESH_SUFFIXES, read_mesh_file
from runtime.characters.palette import linear_from_srgb, palette_color
from tests.thorough import examples

TETRAHEDRON = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 1.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
SIGNALLING_NAN = bytes.fromhex("0000817f")  # a float32, which NumPy warns of


def written(folder: Path, name: str, text: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def mesh_or_refusal(path: Path) -> FileMesh | str:
    try:
        return read_mesh_file(path)
    except InputError as error:
        return str(error)


def rows(values: np.ndarray) -> str:
    return "\n".join(" ".join(str(x) for x in row) for row in values.tolist())


def as_obj() -> str:
    lines = [f"v {' '.join(map(str, v))}" for v in TETRAHEDRON.tolist()]
    return "\n".join(lines + [f"f {' '.join(str(i + 1) for i in f)}" for f in FACES.tolist()])


def as_off() -> str:
    return f"OFF\n4 4 0\n{rows(TETRAHEDRON)}\n{rows(np.column_stack([[3] * 4, FACES]))}\n"


def as_ply(kind: str = "ascii") -> bytes:
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if kind == "ascii":
        faces = np.column_stack([[3] * 4, FACES])
        return head + f"{rows(TETRAHEDRON)}\n{rows(faces)}\n".encode()
    return (
        head
        + TETRAHEDRON.astype("<f4").tobytes()
        + b"".join(struct.pack("<B3i", 3, *f) for f in FACES.tolist())
    )


def as_stl() -> str:
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "\n".join(f"vertex {' '.join(map(str, TETRAHEDRON[i].tolist()))}" for i in face)
        + "\nendloop\nendfacet"
        for face in FACES.tolist()
    ]
    return "solid thing\n" + "\n".join(facets) + "\nendsolid thing\n"


def as_binary_stl() -> bytes:
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *TETRAHEDRON[face].ravel(), 0) for face in FACES)
    return b"solid but binary".ljust(80) + struct.pack("<I", 4) + body


def as_medit() -> str:
    return (
        "MeshVersionFormatted 1\nDimension 3\nVertices 4\n"
        + rows(np.column_stack([TETRAHEDRON, [0] * 4]))
        + "\nTriangles 4\n"
        + rows(np.column_stack([FACES + 1, [7] * 4]))
        + "\nEnd\n"
    )


FILES = {
    "a.obj": as_obj(),
    "a.off": as_off(),
    "a.ply": as_ply(),
    "b.ply": as_ply("binary_little_endian"),
    "a.stl": as_stl(),
    "b.stl": as_binary_stl(),
    "a.mesh": as_medit(),
}


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_surface(name: str, tmp_path: Path) -> None:
    mesh = read_mesh_file(written(tmp_path, name, FILES[name]))
    np.testing.assert_allclose(mesh.vertices[mesh.faces], TETRAHEDRON[FACES], atol=1e-7)
    if Path(name).suffix != ".stl":  # STL has no vertices, only corners
        np.testing.assert_array_equal(mesh.faces, FACES)


@pytest.mark.parametrize("name", FILES)
def test_a_file_cut_short_is_refused_or_whole_in_what_is_left(name: str, tmp_path: Path) -> None:
    whole = FILES[name] if isinstance(FILES[name], bytes) else FILES[name].encode()
    refused = 0
    for size in np.linspace(0, len(whole) - 10, 12).astype(int):
        path = written(tmp_path, name, whole[:size])
        mesh = mesh_or_refusal(path)
        if isinstance(mesh, str):
            refused += 1
            assert str(path) in mesh
            assert "\n" not in mesh
        else:
            assert mesh.faces.max() < len(mesh.vertices)
            assert name in {"a.obj", "a.mesh"}  # their last number may be cut, or their end
    assert refused >= 8


@given(st.sampled_from(sorted(FILES)), st.binary(max_size=400), st.integers(0, 300))
@settings(max_examples=examples(120), deadline=None)
def test_damaged_files_give_a_mesh_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, name: str, noise: bytes, at: int
) -> None:
    whole = FILES[name] if isinstance(FILES[name], bytes) else FILES[name].encode()
    path = written(
        tmp_path_factory.mktemp("damaged"), name, whole[:at] + noise + whole[at + len(noise) :]
    )
    mesh = mesh_or_refusal(path)
    if isinstance(mesh, str):
        assert "\n" not in mesh
    else:
        assert np.isfinite(mesh.vertices).all()
        assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)


@pytest.mark.parametrize("name", ["b.ply", "b.stl"])
def test_a_signalling_nan_is_refused_and_not_warned_of(name: str, tmp_path: Path) -> None:
    whole = FILES[name]
    assert isinstance(whole, bytes)
    corner = struct.pack("<3f", *TETRAHEDRON[1])
    damaged = whole.replace(corner, SIGNALLING_NAN + corner[4:])
    assert damaged != whole
    assert "not a finite number" in str(mesh_or_refusal(written(tmp_path, name, damaged)))


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("e.obj", "", "empty"),
        ("e.obj", "# nothing", "no vertices"),
        ("p.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
        ("n.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3", "vertex 0 is not a finite number"),
        ("i.obj", "v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3", "vertex 1 is not a finite number"),
        ("r.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4", "not among the 3"),
        ("r.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4", "not among the 3"),
        ("w.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x", "line 4"),
        ("d.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3", "no extent"),
        ("n.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no faces"),
        ("h.off", "OFF\n3000000 1 0\n", "3000000 vertices"),
        ("h.off", "PNG\n3 1 0\n", "does not begin with OFF"),
        ("s.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "fewer corners"),
        ("t.stl", b"\0" * 80 + struct.pack("<I", 10**9), "announces 1000000000"),
        ("t.stl", "solid x\nfacet\nouter loop\nvertex 0 0 0\n", "endsolid"),
        ("t.ply", "hello", "header of a PLY"),
        ("t.mesh", "hello", "no MEDIT"),
        ("t.mesh", "MeshVersionFormatted 1\nVertices\n9\n0 0 0 0\n", "vertices is damaged"),
    ],
)
def test_bad_files_are_refused_in_one_line(
    name: str, text: str | bytes, says: str, tmp_path: Path
) -> None:
    path = written(tmp_path, name, text)
    with pytest.raises(InputError, match=says) as caught:
        read_character(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_what_is_no_character_names_what_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.vrm.*mannequin"):
        read_character(written(tmp_path, "notes.txt", "hello"))
    with pytest.raises(InputError, match="no such file"):
        read_character(tmp_path / "absent.obj")
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(InputError, match="not a file"):
        read_character(tmp_path / "folder.obj")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("c.off", "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 188 128\n3 0 1 2"),
        ("c.off", "COFF 3 1 0\n0 0 0 1. 0 0\n1 0 0 0 1. 0\n# x\n0 1 0 0 0 .7372549\n3 0 1 2 9 9"),
        ("c.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 .7372549\nf 1 2 3"),
    ],
)
def test_colours_of_vertices_become_linear(name: str, text: str, tmp_path: Path) -> None:
    colors = read_mesh_file(written(tmp_path, name, text)).colors
    assert colors is not None
    assert colors.dtype == np.float32
    np.testing.assert_allclose(colors[:, :3], [[1, 0, 0], [0, 1, 0], [0, 0, 0.5029]], atol=1e-4)


def test_colours_that_are_no_numbers_are_noted(tmp_path: Path) -> None:
    text = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 nan nan nan\nf 1 2 3"
    character = read_character(written(tmp_path, "c.obj", text))
    np.testing.assert_allclose(character.surface.colors, [[1, 0, 0, 1]] * 3)
    assert any("colours" in note for note in character.notes)


def test_tetrahedra_alone_show_their_boundary(tmp_path: Path) -> None:
    corners = np.vstack([TETRAHEDRON, [2.0, 3.0, 1.5]])
    text = (
        "MeshVersionFormatted 2\nDimension\n3\nVertices\n5\n"
        + rows(np.column_stack([corners, [0] * 5]))
        + "\nTetrahedra\n2\n1 2 3 4 1\n2 3 4 5 1\nEnd\n"
    )
    mesh = read_mesh_file(written(tmp_path, "t.mesh", text))
    assert len(mesh.faces) == 6
    edges = np.sort(np.vstack([mesh.faces[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed


def test_a_loaded_character_keeps_its_promises(tmp_path: Path) -> None:
    text = "v 7 7 7\n" + as_stl_like_obj()
    character = read_character(written(tmp_path, "soup.obj", text))
    surface = character.surface
    assert len(surface.vertex) == 13
    assert len(character.vertices) == 5  # four corners, and one that no face uses
    np.testing.assert_array_equal(surface.vertex[surface.faces], character.faces)
    file_vertices = character.in_file_coordinates(character.vertices)
    np.testing.assert_allclose(file_vertices[1:4], TETRAHEDRON[FACES[0]], atol=1e-12)
    np.testing.assert_allclose(file_vertices[0], [7, 7, 7], atol=1e-12)
    assert character.skeleton.names[0] == "node0"
    np.testing.assert_allclose(surface.colors, surface.colors[:1].repeat(13, axis=0))


def as_stl_like_obj() -> str:
    corners = TETRAHEDRON[FACES].reshape(-1, 3)
    lines = [f"v {' '.join(map(str, v))}" for v in corners.tolist()]
    lines += [f"f {3 * i + 2} {3 * i + 3} {3 * i + 4}" for i in range(4)]
    return "\n".join(lines)


def test_the_palette_gives_the_same_surface_the_same_colour() -> None:
    color = palette_color(TETRAHEDRON, FACES)
    np.testing.assert_array_equal(color, palette_color(TETRAHEDRON.copy(), FACES.copy()))
    assert color[3] == 1.0
    assert np.ptp(color[:3]) > 0.1
    others = {tuple(palette_color(TETRAHEDRON * s, FACES)) for s in np.linspace(1, 2, 40)}
    assert len(others) > 4


def test_srgb_is_decoded_by_its_curve() -> None:
    encoded = np.array([[0.0, 0.04045, 0.5], [1.0, 2.0, -1.0]])
    np.testing.assert_allclose(
        linear_from_srgb(encoded), [[0, 0.0031308, 0.2140411, 1], [1, 1, 0, 1]], atol=1e-6
    )


def test_real_files_load_or_are_refused_in_one_line(shared: Path) -> None:
    sound, refused = 0, []
    for path in sorted((shared / "mesh").rglob("*")):
        if not path.is_file() or path.stat().st_size > 600_000:
            continue
        if path.suffix.lower() not in MESH_SUFFIXES:
            assert path.suffix not in SUFFIXES
            continue
        mesh = mesh_or_refusal(path)
        if isinstance(mesh, str):
            assert "\n" not in mesh
            refused.append(path.name)
        else:
            assert np.isfinite(mesh.vertices).all()
            sound += 1
    assert refused == ["tm_empty.obj", "tm_obj_points.obj"]
    assert sound > 20
