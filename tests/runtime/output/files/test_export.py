"""Which exporter a file's suffix chooses."""

from __future__ import annotations

from pathlib import Path

import pytest

from devices.errors import InputError
from runtime.output.files.export import open_export
from tests.runtime.tentacle import make_show, make_tentacle


@pytest.mark.parametrize("suffix", ["glb", "bvh", "usda", "usdc", "GLB"])
def test_the_suffix_decides(tmp_path: Path, suffix: str) -> None:
    if suffix.startswith("usd"):
        pytest.importorskip("pxr")
    path = tmp_path / f"a.{suffix}"
    character = make_tentacle()
    with open_export(path, character, rate=25.0) as output:
        assert output.pictures_a_second == 0.0
        for frame in make_show(character, frames=3):
            output.write(frame)
    heads = {"glb": b"glTF", "bvh": b"HIERARCHY", "usda": b"#usda", "usdc": b"PXR-USDC"}
    assert path.read_bytes().startswith(heads[suffix.lower()])


def test_an_unknown_suffix_lists_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.glb, \.usdc, \.usda, \.bvh"):
        open_export(tmp_path / "a.fbx", make_tentacle())
