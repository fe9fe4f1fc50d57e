"""Formats that are known and not read are answered with what converts them, in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from devices.errors import InputError
from replay.formats import read_recording
from runtime.characters.character_file import read_character


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.fbx", b"Kaydara FBX Binary  \0\x1a\0", "FBX is not read; open it in Blender"),
        ("walk", b"Kaydara FBX Binary  \0\x1a\0", "FBX is not read"),
        ("a.fbx", b"; FBX 7.4.0 project file\n", "FBX is not read"),
        ("a.vmd", b"Vocaloid Motion Data 0002\0", "mmd_tools"),
        ("a.dae", b"<?xml?><COLLADA>", "COLLADA is not read"),
        ("a.npz", b"PK\3\4", "NumPy archive"),
    ],
)
def test_other_motion_is_answered_with_a_way(
    name: str, content: bytes, says: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=says) as refused:
        read_recording(path)
    assert "BVH" in str(refused.value) or "MediaPipe" in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["a.fbx", "A.PMX", "a.dae", "a.blend"])
def test_other_characters_are_answered_with_a_way(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(InputError, match=r"is not read; open it in Blender.* export glb"):
        read_character(tmp_path / name)
