"""Chooses the exporter of a performed character by the suffix of the file."""

from __future__ import annotations

from pathlib import Path

from runtime.characters.character import Character
from runtime.output.files.bvh_export import BvhExport
from runtime.output.files.gltf_export import GltfExport
from runtime.output.files.usd_export import UsdExport
from runtime.output.files.whole_file import check_suffix
from runtime.output.output import Output

SUFFIXES = (".glb", ".usdc", ".usda", ".bvh")
OF_NODES = (".glb", ".bvh")  # the exports of a skeleton's motion, which need posed nodes


def open_export(
    path: Path, character: Character, *, rate: float = 30.0, within: float | None = None
) -> Output:
    """Open the exporter for the suffix of `path`: .glb, .usda, .usdc or .bvh.

    Args:
        path: the file to write.
        character: the performed character.
        rate: approximate frames per second.
        within: of a .glb or .bvh: how far it may be from the performance, as a share of the
            character's height; None for a skin alone, or rigid bones.

    Raises:
        InputError: the suffix is unknown, a library is missing, or the file cannot be written.
    """
    suffix = check_suffix(path, SUFFIXES)
    if suffix == ".glb":
        return GltfExport(path, character, within=within)
    if suffix == ".bvh":
        return BvhExport(path, character, within=within)
    return UsdExport(path, character, rate=rate)
