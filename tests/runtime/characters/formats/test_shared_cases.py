"""Files as other programs write them, from the shared cases: what `expect.txt` says is right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from runtime.characters.formats.mesh_data import FileMesh
from runtime.characters.formats.mesh_file import read_mesh_file
from runtime.characters.gltf.rig import GltfModel, read_gltf


@pytest.fixture
def cases(shared: Path) -> Path:
    return shared.parent / "cases"


def areas(mesh: FileMesh) -> np.ndarray:
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def colors(mesh: FileMesh) -> list[list[float]]:
    assert mesh.face_material is not None
    return [mesh.materials[i].color.tolist() for i in np.unique(mesh.face_material)]


@pytest.mark.parametrize("name", ["u.off", "u.ply"])
def test_a_concave_polygon_is_cut_inside_itself(name: str, cases: Path) -> None:
    mesh = read_mesh_file(cases / "38-concave-polygons" / name)
    np.testing.assert_allclose(np.linalg.norm(areas(mesh), axis=1).sum(), 7.0)
    assert (areas(mesh)[:, 2] > 0).all()


def test_a_concave_prism_is_closed_and_keeps_its_volume(cases: Path) -> None:
    mesh = read_mesh_file(cases / "38-concave-polygons" / "prism.obj")
    np.testing.assert_allclose(np.linalg.norm(areas(mesh), axis=1).sum(), 30.0)
    volume = np.einsum("ij,ij->", mesh.vertices[mesh.faces[:, 0]], areas(mesh)) / 3.0
    assert volume == pytest.approx(7.0)
    directed = {tuple(face[[i, (i + 1) % 3]]) for face in mesh.faces for i in range(3)}
    assert all(edge[::-1] in directed for edge in directed)


def test_a_hash_is_part_of_a_name(cases: Path) -> None:
    mesh = read_mesh_file(cases / "39-obj-material-hash" / "key.obj")
    assert colors(mesh) == [[1, 0, 0, 1], [0, 0, 1, 1]]
    assert mesh.face_material is not None
    assert np.bincount(mesh.face_material).tolist() == [0, 106, 106]


@pytest.mark.parametrize("name", ["40-mtl-tabs/tabs.obj", "41-obj-bom/bom.obj"])
def test_tabs_and_byte_order_marks_are_skipped(name: str, cases: Path) -> None:
    assert colors(read_mesh_file(cases / name)) == [[1, 0, 0, 1]]


def test_a_byte_order_mark_hides_no_vertex(cases: Path) -> None:
    assert len(read_mesh_file(cases / "41-obj-bom" / "bom_v.obj").vertices) == 108


def test_full_transparency_of_every_material_is_taken_as_opaque(cases: Path) -> None:
    mesh = read_mesh_file(cases / "45-mtl-tr-one" / "tr.obj")
    assert colors(mesh) == [[1, 0, 0, 1]]
    assert any("taken as opaque" in note for note in mesh.notes)


def test_texture_coordinates_of_corners_split_no_vertex(cases: Path) -> None:
    mesh = read_mesh_file(cases / "47-ply-wedge-texcoord" / "wedge.ply")
    assert (len(mesh.vertices), len(mesh.faces)) == (108, 212)


@pytest.mark.parametrize("name", ["assimp", "diffuse", "faces"])
def test_colours_by_other_names_and_of_faces_are_orange(name: str, cases: Path) -> None:
    found = read_mesh_file(cases / "49-ply-colour-names" / f"{name}.ply").colors
    assert found is not None
    np.testing.assert_allclose(found, np.tile([1.0, 0.215, 0.051, 1.0], (108, 1)), atol=3e-3)


def test_an_off_header_without_a_break(cases: Path) -> None:
    mesh = read_mesh_file(cases / "50-off-glued-header" / "modelnet.off")
    assert (len(mesh.vertices), len(mesh.faces)) == (108, 212)


def solid(model: GltfModel) -> float:
    a, b, c = model.file_vertices[model.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("name", ["mesh_weights", "node_weights"])
def test_default_morph_weights_shape_the_rest_surface(name: str, cases: Path) -> None:
    model = read_gltf(cases / "27-gltf-morph-default-weights" / f"{name}.glb")
    np.testing.assert_allclose(np.ptp(model.file_vertices, axis=0), [0.9, 2.0, 0.9], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "note"),
    [
        ("28-gltf-joints-float/float.glb", "no unsigned integers"),
        ("30-glb-json-padded-with-zeros/nul.glb", ""),
        ("31-gltf-mirrored-skin/mirror.glb", ""),
        ("36-gltf-mesh-outside-scene/outside.gltf", "default scene draws no mesh"),
    ],
)
def test_gltf_of_other_exporters_is_the_same_prism(name: str, note: str, cases: Path) -> None:
    model = read_gltf(cases / name)
    assert (len(model.file_vertices), len(model.faces)) == (108, 212)
    assert solid(model) == pytest.approx(0.54)
    assert note in "; ".join(model.notes)


@pytest.mark.parametrize("case", ["01-*", "03-*", "04-*", "08-*"])
def test_hostile_pictures_end_in_a_note_at_most(
    case: str, cases: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folders = sorted((cases / "hostile").glob(case))
    assert folders
    for folder in folders:
        (path,) = (p for p in folder.iterdir() if p.suffix in (".obj", ".ply"))
        assert len(read_mesh_file(path).notes) <= 1
    assert capfd.readouterr() == ("", "")
