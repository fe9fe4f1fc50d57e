"""Untrusted mesh files: what is bounded before it is used."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest

from devices.errors import InputError
from runtime.characters.formats.medit import read_medit
from runtime.characters.formats.mesh_data import MOST_WORDS, MeshError
from runtime.characters.formats.mesh_file import read_mesh_file
from runtime.characters.formats.off import read_off
from runtime.characters.formats.stl import read_stl

MIB = 1 << 20
CORNERS = b"vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"


def test_one_long_number_makes_no_others_long() -> None:
    long = b"0" * (MIB // 2) + b"1"
    content = b"solid a\nvertex 0 0 " + long + b"\nvertex 1 0 0\nvertex 0 1 0\n"
    content += CORNERS * 300 + b"endsolid\n"
    tracemalloc.start()
    mesh = read_stl(content)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert mesh.vertices[0].tolist() == [0.0, 0.0, 1.0]
    assert len(mesh.faces) == 301
    assert peak < 8 * MIB


def test_what_is_no_number_is_shown_in_short() -> None:
    with pytest.raises(MeshError) as told:
        read_stl(b"solid a\nvertex 0 0 " + b"x" * MIB + b"\n" + CORNERS + b"endsolid\n")
    assert len(str(told.value)) < 200


def test_a_polygon_without_end_is_refused() -> None:
    content = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n15000000 " + b"0 1 2 " * 5_000_000 + b"\n"
    with pytest.raises(MeshError, match="words"):
        read_off(content)


@pytest.mark.parametrize(
    "face", [b"3 0 1 9999999999999999999999", b"9999999999999999999999 0 1 2", b"-1 0 1 2"]
)
def test_integers_beyond_64_bits_are_refused(face: bytes) -> None:
    with pytest.raises(MeshError, match="face"):
        read_off(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n" + face + b"\n")


def test_counts_that_no_file_has_are_refused() -> None:
    with pytest.raises(MeshError):
        read_off(b"OFF\n" + b"9" * 30 + b" 1 0\n0 0 0\n")


def test_more_words_than_memory_are_refused() -> None:
    with pytest.raises(MeshError, match="words"):
        read_medit(b"MeshVersionFormatted 1\n" + b" 1" * (MOST_WORDS + 1))


def test_integers_of_an_obj_beyond_64_bits_are_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    for face in ("1 2 99999999999999999999999", "1/1 2/1 -99999999999999999999999/1"):
        path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf {face}\n")
        with pytest.raises(InputError, match=r"a\.obj: "):
            read_mesh_file(path)
