"""Read the expressions of a VRM file: which morph targets each of them moves, and its rules.

Materials and textures that an expression changes are left out.

Source: VRM Consortium, "VRM 0.x: blendshape" and "VRMC_vrm 1.0: expressions".
"""

from __future__ import annotations

from devices.errors import ContentError
from replay.gltf.checked_json import Entry
from replay.gltf.file import GltfFile
from runtime.characters.gltf.morphs import LONGEST_NAME, MorphReader
from runtime.characters.morphs import BLEND, BLOCK, NONE, Expression

MOST_EXPRESSIONS = 512
MOST_BINDS = 1024  # of one expression


def read_expressions(
    file: GltfFile, morphs: MorphReader
) -> tuple[tuple[Expression, ...], tuple[str, ...]]:
    """Return the expressions that a file declares, and notes; none where they are damaged.

    Args:
        file: the file.
        morphs: has read its morph targets.
    """
    new, old = file.document.extension("VRMC_vrm"), file.document.extension("VRM")
    try:
        if new is not None:
            found = _of_vrm_1(file, new, morphs)
        else:
            found = [] if old is None else _of_vrm_0(old, morphs)
    except ContentError as error:
        return (), (f"its expressions are left out: {error}",)
    if len(found) > MOST_EXPRESSIONS:
        return (), (f"its {len(found)} expressions are left out: more than {MOST_EXPRESSIONS}",)
    return tuple(found), ()


def _of_vrm_1(file: GltfFile, vrm: Entry, morphs: MorphReader) -> list[Expression]:
    declared = vrm.child("expressions")
    groups = [] if declared is None else [declared.child("preset"), declared.child("custom")]
    found = []
    for group in groups:
        for name in [] if group is None else group.fields:
            entry = group.child(name) if group is not None else None
            if entry is None or not _is_name(name):
                continue
            binds = []
            for bind in _binds(entry, "morphTargetBinds"):
                node = file.entry("nodes", bind.whole("node"))
                if "mesh" in node:
                    number = morphs.number(node.whole("mesh"), bind.whole("index"))
                    binds.append((number, bind.number("weight", 1.0)))
            found.append(
                Expression(
                    name,
                    _bounded(binds),
                    entry.flag("isBinary"),
                    _override(entry, "overrideBlink"),
                    _override(entry, "overrideLookAt"),
                    _override(entry, "overrideMouth"),
                )
            )
    return found


def _of_vrm_0(vrm: Entry, morphs: MorphReader) -> list[Expression]:
    master = vrm.child("blendShapeMaster")
    found = []
    for group in [] if master is None else master.children("blendShapeGroups"):
        preset = group.text("presetName", "unknown")
        name = group.text("name", "") if preset in ("", "unknown") else preset
        if not _is_name(name):
            continue
        binds = [
            (
                morphs.number(bind.whole("mesh"), bind.whole("index")),
                bind.number("weight", 100.0) / 100.0,
            )
            for bind in _binds(group, "binds")
            if bind.fields.get("mesh") != -1
        ]
        found.append(Expression(name, _bounded(binds), group.flag("isBinary")))
    return found


def _bounded(binds: list[tuple[int | None, float]]) -> tuple[tuple[int, float], ...]:
    """The binds of targets that were read, their weights in [0, 1]."""
    return tuple((t, min(max(weight, 0.0), 1.0)) for t, weight in binds if t is not None)


def _binds(entry: Entry, name: str) -> list[Entry]:
    binds = entry.children(name)
    if len(binds) > MOST_BINDS:
        raise entry.wrong(f"it has more than {MOST_BINDS} {name}")
    return binds


def _is_name(name: str) -> bool:
    return 0 < len(name) <= LONGEST_NAME and name.isprintable()


def _override(entry: Entry, name: str) -> str:
    value = entry.text(name, NONE)
    return value if value in (BLEND, BLOCK) else NONE
