"""OBJ, MTL and STL as other programs write them: commas, codes, names of files, options."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from runtime.characters.formats.mesh_data import FileMesh
from runtime.characters.formats.mesh_file import read_mesh_file

BODY = "v 0 0 0\nv 1,5 0 0\nv 0 2,5 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n"
OBJ = "mtllib a.mtl\n" + BODY.replace(",", ".")


def saved(folder: Path, obj: str, mtl: str, encoding: str = "utf-8") -> FileMesh:
    (folder / "a.obj").write_bytes(obj.encode(encoding))
    (folder / "a.mtl").write_bytes(mtl.encode(encoding))
    return read_mesh_file(folder / "a.obj")


def color(mesh: FileMesh) -> list[float]:
    assert mesh.face_material is not None
    return np.round(mesh.materials[mesh.face_material[0]].color, 6).tolist()


def picture(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((2, 4, 3), 200, dtype=np.uint8)).save(path)


@pytest.mark.parametrize(
    ("mtl", "expected"),
    [
        ("newmtl skin\nKd 1,0 0,0 0,0\n", [1, 0, 0, 1]),
        ("newmtl skin\n\tKd\t1 0 0\n\td\t0,5\n", [1, 0, 0, 0.5]),
        ("newmtl skin\nKd 1 0 0\nTr 0.75\n", [1, 0, 0, 0.25]),
        ("newmtl skin\nKd 1 0 0\nTr 1\nnewmtl b\nKd 0 0 0\nTr 1.0\n", [1, 0, 0, 1]),
    ],
)
def test_settings_of_a_material(mtl: str, expected: list[float], tmp_path: Path) -> None:
    mesh = saved(tmp_path, "mtllib a.mtl\n" + BODY, mtl)
    assert color(mesh) == expected
    np.testing.assert_allclose(mesh.vertices[1:3], [[1.5, 0, 0], [0, 2.5, 0]])


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    mesh = saved(tmp_path, OBJ, "newmtl skin\nKd 0 1 0\n", encoding)
    assert color(mesh) == [0, 1, 0, 1]


@pytest.mark.parametrize(
    ("line", "files"),
    [
        ("a.mtl b.mtl", ("a.mtl", "b.mtl")),
        ("b.mtl  a.MTL", ("a.MTL", "b.mtl")),
        ("my skin.mtl", ("my skin.mtl",)),
        ("my skin.mtl other one.mtl", ("my skin.mtl", "other one.mtl")),
        ("C:\\work\\models\\skin.mtl", ("skin.mtl",)),
        ("/opt/models/skin.mtl", ("skin.mtl",)),
        ("./Parts/Skin.mtl", ("parts/skin.MTL",)),
        ('"skin.mtl"', ("skin.mtl",)),
    ],
)
def test_libraries_are_found_beside_the_mesh(
    line: str, files: tuple[str, ...], tmp_path: Path
) -> None:
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"newmtl {Path(name).stem}\nKd 0 0 1\n")
    used = Path(files[-1]).stem
    text = f"mtllib {line}\n" + OBJ.partition("\n")[2].replace("usemtl skin", f"usemtl {used}")
    (tmp_path / "o.obj").write_text(text)
    mesh = read_mesh_file(tmp_path / "o.obj")
    assert color(mesh) == [0, 0, 1, 1]
    assert mesh.notes == ()


@pytest.mark.parametrize(
    ("value", "file"),
    [
        ("skin.png", "skin.png"),
        ("Skin.PNG", "skin.png"),
        ("textures\\Skin.png", "Textures/skin.PNG"),
        ("C:\\work\\skin.png", "skin.png"),
        ("/opt/models/skin.png", "skin.png"),
        ("\\\\host\\share\\skin.png", "skin.png"),
        ("-s 1 1 1 -o 0.5 0 skin.png", "skin.png"),
        ("-bm 0,5 my skin.png", "my skin.png"),
        ("skin.png -bm 1.0", "skin.png"),
        ("my skin.png -s 1 1 1 -clamp on", "my skin.png"),
        ('"my skin.png"', "my skin.png"),
        ("well-s 1.png", "well-s 1.png"),
    ],
)
def test_textures_are_found_beside_the_mesh(value: str, file: str, tmp_path: Path) -> None:
    picture(tmp_path / file)
    mesh = saved(tmp_path, OBJ, f"newmtl skin\nKd 1 0 0\nmap_Kd {value}\n")
    assert mesh.face_material is not None
    assert mesh.materials[mesh.face_material[0]].texture is not None
    assert mesh.notes == ()


@pytest.mark.parametrize("value", ["../skin.png", "..\\skin.png", "sub/../../skin.png"])
def test_no_texture_is_taken_from_outside(value: str, tmp_path: Path) -> None:
    picture(tmp_path / "skin.png")
    inside = tmp_path / "inside"
    inside.mkdir()
    mesh = saved(inside, OBJ, f"newmtl skin\nKd 1 0 0\nmap_Kd {value}\n")
    assert all(material.texture is None for material in mesh.materials)
    assert len(mesh.notes) == 1


STL = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1.5 0 0\nvertex 0 2.5 0\n"
STL += "endloop\nendfacet\nendsolid a\n"


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + STL.encode(),
        STL.replace(".", ",").encode(),
        STL.encode("utf-16"),
        STL.upper().encode(),
    ],
)
def test_stl_in_text(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(content)
    mesh = read_mesh_file(tmp_path / "a.stl")
    np.testing.assert_allclose(mesh.vertices, [[0, 0, 0], [1.5, 0, 0], [0, 2.5, 0]])
