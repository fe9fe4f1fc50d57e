"""Known formats that are not read are refused with one line that names a converter."""

from __future__ import annotations

from pathlib import Path

import pytest

from devices.errors import InputError
from replay.formats import read_recording
from runtime.characters.character_file import read_character

GLB = r"save it as \.glb \(File > Export > glTF 2\.0\)"


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.fbx", b"Kaydara FBX Binary  \0\x1a\0", f"FBX is not read; open it in Blender.*{GLB}"),
        ("WALK.FBX", b"x", f"FBX is not read; open it in Blender.*{GLB}"),
        ("walk", b"Kaydara FBX Binary  \0\x1a\0", "FBX is not read"),
        ("a.fbx", b"; FBX 7.4.0 project file\n", "FBX is not read"),
        ("a.bin", b"Vocaloid Motion Data 0002\0", f"mmd_tools.*{GLB}"),
        ("A.PMX", b"PMX \0\0\0@", f"mmd_tools.*{GLB}"),
        ("a.dae", b"<?xml?><COLLADA>", f"COLLADA is not read.*{GLB}"),
        ("a", b"BLENDER-v300", f"open it in Blender and {GLB}"),
        ("a.mb", b"FOR4", f"Maya.*FBX.*{GLB}"),
        ("a.usdz", b"PK\3\4", f"USD is not read.*{GLB}"),
        ("a.usd", b"#usda 1.0\n", f"USD is not read.*{GLB}"),
        ("a.max", b"x", f"3ds Max.*{GLB}"),
        ("a.TAK", b"x", "export CSV from Motive"),
        ("a.mvn", b"x", "export MVNX"),
        ("a.npz", b"PK\3\4", "only motion of SMPL bodies"),
        ("a.zip", b"PK\3\4", "unpack it"),
    ],
)
def test_other_motion_is_answered_with_a_way(
    name: str, content: bytes, says: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=says) as refused:
        read_recording(path)
    assert "is not read; " in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "name", "a.fbx A.FBX A.PMX a.pmd a.dae a.blend a.USDC a.max a.ma a.3ds a.x3d a.vmd".split()
)
def test_other_characters_are_answered_with_a_way(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(InputError, match=rf"is not read; open it in .*{GLB}"):
        read_character(tmp_path / name)


def test_an_unknown_character_is_answered_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no character is read from \.bvh; use \.obj"):
        read_character(tmp_path / "a.bvh")
