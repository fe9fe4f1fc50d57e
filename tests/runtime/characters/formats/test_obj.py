"""OBJ files: what lines mean, materials, damaged lines and bounds."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from devices.errors import InputError
from runtime.characters.character_file import read_character
from runtime.characters.formats import obj_lines
from runtime.characters.formats.mesh_file import read_mesh_file
from tests.runtime.characters.formats.test_mesh_file import written
from tests.thorough import examples

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def test_obj_keeps_the_order_of_its_v_lines_and_reads_relative_corners(tmp_path: Path) -> None:
    text = (
        "v 0 0 0\nv 9 9 9\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\n"
        "f 1/1 3/2 5/1 4/2\nf -1// \\\n -2// -5//\no second\nf 1/1 2/2\n"
    )
    mesh = read_mesh_file(written(tmp_path, "a.obj", text))
    np.testing.assert_array_equal(mesh.vertices[:3], [[0, 0, 0], [9, 9, 9], [1, 0, 0]])
    np.testing.assert_array_equal(mesh.faces, [[0, 2, 4], [0, 4, 3], [4, 3, 0]])
    assert mesh.uvs is None  # there is no texture that they would serve
    assert mesh.notes == ("left out 1 faces of fewer than three corners",)


def textured(folder: Path) -> Path:
    Image.fromarray(np.full((2, 4, 3), 200, dtype=np.uint8)).save(folder / "skin map.png")
    written(
        folder,
        "a.mtl",
        "newmtl skin\nKd 0 0 0\nmap_Kd skin map.png\nnewmtl red\nKd 1 0 0\nd 0.5\n",
    )
    text = (
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt .25 .75\n"
        "usemtl skin\nf 1/1 2/2 3/3\nusemtl red\nf 2/4 4/2 3/3\n"
    )
    return written(folder, "a.obj", text)


def test_obj_splits_what_a_uv_seam_splits_after_the_v_lines(tmp_path: Path) -> None:
    character = read_character(textured(tmp_path))
    surface = character.surface
    assert surface.uvs is not None
    np.testing.assert_array_equal(surface.vertex, [0, 1, 2, 3, 1])
    np.testing.assert_array_equal(surface.faces, [[0, 1, 2], [4, 3, 2]])
    np.testing.assert_array_equal(surface.vertex[surface.faces], character.faces)
    np.testing.assert_allclose(
        surface.uvs[surface.faces],
        [[[0, 1], [1, 1], [0, 0]], [[0.25, 0.25], [1, 1], [0, 0]]],  # v downwards, as in glTF
    )
    skin, red = (surface.materials[i] for i in surface.face_material)
    assert skin.texture is not None
    assert skin.texture.shape == (2, 4, 4)
    np.testing.assert_allclose(skin.color, 1.0)
    np.testing.assert_allclose(red.color, [1, 0, 0, 0.5])
    np.testing.assert_allclose(surface.colors, 1.0)


@pytest.mark.parametrize("missing", ["a.mtl", "skin map.png"])
def test_a_missing_material_or_texture_is_noted(missing: str, tmp_path: Path) -> None:
    path = textured(tmp_path)
    (tmp_path / missing).unlink()
    character = read_character(path)
    assert any(missing in note for note in character.notes)


def test_a_damaged_texture_is_noted(tmp_path: Path) -> None:
    path = textured(tmp_path)
    (tmp_path / "skin map.png").write_bytes(b"no image")
    assert any("skin map.png" in note for note in read_character(path).notes)


def test_a_library_that_names_no_file_is_no_error(tmp_path: Path) -> None:
    path = written(tmp_path, "a.obj", "mtllib\nmtllib /dev/null\0x\n" + TRIANGLE)
    assert len(read_mesh_file(path).faces) == 1


def one_line_at_a_time(text: str) -> tuple[list[list[float]], list[tuple[int, int]], list[int]]:
    """Positions, corners and corner counts of an OBJ, by the shortest code that does it."""
    positions: list[list[float]] = []
    corners: list[tuple[int, int]] = []
    sizes = []
    uvs = 0
    for line in text.replace("\\\n", " ").splitlines():
        keyword, *words = line.partition("#")[0].split() or [""]
        if keyword == "v":
            positions.append([float(word) for word in words[:3]])
        uvs += keyword == "vt"
        if keyword == "f" and len(words) > 2:
            for word in words:
                v, t = (int(number or 0) for number in (word + "//").split("/")[:2])
                corners.append(
                    (v - (v > 0) + len(positions) * (v < 0), t - 1 if t >= 0 else uvs + t)
                )
            sizes.append(len(words))
    return positions, corners, sizes


def some_obj(rng: random.Random) -> str:
    """Lines in any order and form that the format allows."""
    blank = rng.choice([" ", "\t", "  ", " \\\n"])
    form = rng.choice(["{v}", "{v}/{t}", "{v}//{n}", "{v}/{t}/{n}", "mixed"])
    sizes = rng.choice([[3], [4], [3, 4, 5], [1, 2, 3]])
    negative = rng.random() < 0.3
    lines: list[str] = ["v 0 0 0", "vt 0 0"]
    for _ in range(rng.randrange(1, 30)):
        kind = rng.choice("v v vt vn f f f # usemtl".split())
        if kind in ("v", "vt", "vn"):
            lines.append(blank.join([kind] + [f"{rng.gauss(0, 1):.3g}" for _ in range(3)]))
        elif kind == "f":
            words = []
            for _ in range(rng.choice(sizes)):
                v, t = (-rng.randrange(1, 4), -1) if negative else (rng.randrange(1, 9), 1)
                chosen = rng.choice(["{v}", "{v}/{t}", "{v}//", "{v}/{t}/"])
                words.append((chosen if form == "mixed" else form).format(v=v, t=t, n=1))
            lines.append(blank.join(["f", *words]) + rng.choice(["", "", " # f 1 2 3"]))
        else:
            lines.append(rng.choice(["# f 1 2 3", "", "g thing", "usemtl a", "  s off", "vp 1 2"]))
    return "\n".join(lines) + rng.choice(["", "\n"])


@given(
    st.integers(0, 2**32), st.sampled_from(["\n", "\r\n", "\r"]), st.sampled_from([1, 40, 1 << 20])
)
@settings(max_examples=examples(150), deadline=None)
def test_lines_in_bulk_read_as_lines_one_by_one(seed: int, newline: str, block: int) -> None:
    text = some_obj(random.Random(seed))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(obj_lines, "_BLOCK", block)
        read = obj_lines.parse_obj(text.replace("\n", newline).encode())
    positions, corners, sizes = one_line_at_a_time(text)
    np.testing.assert_array_equal(read.positions, positions)
    np.testing.assert_array_equal(read.corners, np.array(corners, dtype=int).reshape(-1, 2))
    np.testing.assert_array_equal(read.sizes, sizes)


@pytest.mark.parametrize("block", [1, 1 << 20])
def test_materials_hold_until_the_next_line_that_names_one(
    block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(obj_lines, "_BLOCK", block)
    written(tmp_path, "a.mtl", "newmtl a b\nKd 1 0 0\nnewmtl c # or d\nKd 0 1 0\n")
    text = "mtllib a.mtl\n" + TRIANGLE + "f 1 2 3 1\nusemtl a  b\nf 1 2 3 2\nusemtl c\n"
    mesh = read_mesh_file(written(tmp_path, "a.obj", text + "f 3 2 1\nusemtl a b\nf 3 2 1"))
    assert mesh.face_material is not None
    np.testing.assert_array_equal(mesh.face_material, [0, 0, 0, 1, 1, 2, 1])
    np.testing.assert_array_equal(
        [material.color for material in mesh.materials], [[1, 1, 1, 1], [1, 0, 0, 1], [0, 1, 0, 1]]
    )


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("f 1 2 3.5", "line 7 has a face"),
        ("f 1/2 2/x 3", "line 7 has a face"),
        ("f 1 2 99999999999999999999999", "a face names a vertex"),
        ("f -1 2 -99999999999999999999999", "a face names a vertex"),
        ("f 1 2 0", "not among the 3"),
        ("v 0 0", "a v line does not have 3 numbers"),
        ("v 0 0 1;5", "a v line does not have 3 numbers"),
    ],
)
def test_a_damaged_line_is_refused(line: str, says: str, tmp_path: Path) -> None:
    path = written(tmp_path, "a.obj", TRIANGLE + "\n# a comment\n" + line + "\nf 1 2 3\n")
    with pytest.raises(InputError, match=says):
        read_mesh_file(path)


def test_a_damaged_vt_line_is_refused_only_where_a_texture_needs_it(tmp_path: Path) -> None:
    path = textured(tmp_path)
    path.write_text(path.read_text() + "vt x\n")
    with pytest.raises(InputError, match="a vt line does not have 2 numbers"):
        read_mesh_file(path)
    (tmp_path / "a.mtl").unlink()
    assert len(read_mesh_file(path).faces) == 2


def test_counts_and_lines_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, "a.obj", TRIANGLE + "f " + "1 2 3 " * 40)
    monkeypatch.setattr(obj_lines, "MOST_FACES", 100)
    with pytest.raises(InputError, match="more than 100 faces"):
        read_mesh_file(path)
    monkeypatch.setattr(obj_lines, "MOST_VERTICES", 2)
    with pytest.raises(InputError, match="more than 2 vertices"):
        read_mesh_file(path)
    monkeypatch.undo()
    monkeypatch.setattr(obj_lines, "_BLOCK", 8)
    monkeypatch.setattr(obj_lines, "_MOST_LINE", 100)
    with pytest.raises(InputError, match="a line of more than"):
        read_mesh_file(path)


def test_only_pictures_below_the_folder_are_opened(tmp_path: Path) -> None:
    folder = tmp_path / "character"
    folder.mkdir()
    path = textured(folder)
    (folder / "skin map.png").replace(tmp_path / "skin map.png")
    (folder / "a.mtl").write_text("newmtl skin\nmap_Kd ../skin map.png\n")
    mesh = read_mesh_file(path)
    assert mesh.uvs is None
    assert any("outside the character's folder" in note for note in mesh.notes)
    Image.new("RGB", (2, 2)).save(folder / "skin.eps")
    (folder / "a.mtl").write_text("newmtl skin\nmap_Kd skin.eps\n")
    assert any("no PNG, JPEG or WebP" in note for note in read_mesh_file(path).notes)
