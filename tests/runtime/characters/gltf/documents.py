"""glTF documents made for tests, and questions about the models that are read from them."""

from __future__ import annotations

import base64
import copy
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.gltf.rig import GltfModel, read_gltf

TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125}
KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
QUARTER_TURN = [0.0, 0.0, float(np.sqrt(0.5)), float(np.sqrt(0.5))]  # about Z


class Document:
    """A glTF document under construction; `save` writes it as .gltf or .glb."""

    def __init__(self, **top: Any) -> None:
        self.data = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": 0}],
            "bufferViews": [],
            "accessors": [],
            "meshes": [],
            "nodes": [],
            **top,
        }

    def view(self, content: bytes) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        )
        self.data += content
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: ArrayLike, dtype: str = "float32", **extra: Any) -> int:
        array = np.asarray(values, dtype=dtype)
        stored = array.transpose(0, 2, 1) if array.shape[1:] == (4, 4) else array
        self.document["accessors"].append(
            {
                "bufferView": self.view(stored.tobytes()),
                "componentType": COMPONENTS.get(dtype, 5126),
                "count": len(array),
                "type": KINDS[array.shape[1:]],
                **extra,
            }
        )
        return len(self.document["accessors"]) - 1

    def mesh(self, positions: ArrayLike = TRIANGLE, **primitive: Any) -> int:
        attributes = {"POSITION": self.accessor(positions), **primitive.pop("attributes", {})}
        self.document["meshes"].append({"primitives": [{"attributes": attributes, **primitive}]})
        return len(self.document["meshes"]) - 1

    def node(self, **fields: Any) -> int:
        self.document["nodes"].append(fields)
        return len(self.document["nodes"]) - 1

    def save(self, path: Path) -> Path:
        document = copy.deepcopy(self.document)
        document["buffers"][0]["byteLength"] = len(self.data)
        if path.suffix == ".gltf":
            coded = base64.b64encode(self.data).decode()
            document["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{coded}"
            path.write_text(json.dumps(document))
        else:
            path.write_bytes(glb(json.dumps(document).encode(), self.data))
        return path


def glb(text: bytes, data: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def skinned_bar(*, bend: bool = False, scale: float = 1.0) -> Document:
    """A strip of 2 x 3 vertices along Y on two joints, at y = 0 and y = 1, and an end at y = 2."""
    scene = Document()
    positions = np.array([[x, y, 0.0] for y in (0.0, 1.0, 2.0) for x in (0.0, 0.5)]) / scale
    joints = np.zeros((6, 4))
    joints[:, 1] = 1
    weights = np.zeros((6, 4))
    weights[:, 0] = [1, 1, 0.5, 0.5, 0, 0]
    weights[:, 1] = 1.0 - weights[:, 0]
    bind = np.tile(np.eye(4), (2, 1, 1))
    bind[1, 1, 3] = -1.0 / scale
    mesh = scene.mesh(
        positions,
        attributes={
            "JOINTS_0": scene.accessor(joints, "uint8"),
            "WEIGHTS_0": scene.accessor(weights),
        },
        mode=5,
    )
    scene.document["skins"] = [{"joints": [1, 2], "inverseBindMatrices": scene.accessor(bind)}]
    scene.node(name="Armature", scale=[scale] * 3, children=[1])
    scene.node(name="low", children=[2])
    turn = {"rotation": QUARTER_TURN} if bend else {}
    scene.node(name="high", translation=[0, 1 / scale, 0], children=[3], **turn)
    scene.node(name="high_end", translation=[0, 1 / scale, 0])
    scene.node(name="skin", mesh=mesh, skin=0)
    scene.document["skins"][0]["joints"].append(3)
    bind = np.concatenate([bind, bind[1:]])
    scene.document["skins"][0]["inverseBindMatrices"] = scene.accessor(bind)
    return scene


def read(scene: Document, folder: Path, suffix: str = ".glb") -> GltfModel:
    return read_gltf(scene.save(folder / f"model{suffix}"))


def refusal(scene: Document, folder: Path, suffix: str = ".glb") -> str:
    with pytest.raises(InputError) as caught:
        read(scene, folder, suffix)
    message = str(caught.value)
    assert message.startswith(str(folder / f"model{suffix}"))
    assert "\n" not in message
    return message


def parent_names(skeleton: Skeleton | None) -> dict[str, str]:
    assert skeleton is not None
    names = (*skeleton.names, "")
    return {name: names[parent] for name, parent in zip(names, skeleton.parents, strict=False)}


def place(skeleton: Skeleton | None, name: str) -> NDArray[np.float64]:
    assert skeleton is not None
    result: NDArray[np.float64] = skeleton.rest_positions[skeleton.index(name)]
    return result


def png(pixels: ArrayLike) -> str:
    stream = io.BytesIO()
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(stream, "PNG")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def textured(uri: str, **material: Any) -> Document:
    scene = Document(
        materials=[
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 1.5, 0.25, 0.5],
                    "baseColorTexture": {"index": 0},
                },
                **material,
            }
        ],
        textures=[{"source": 0}],
        images=[{"uri": uri, "name": "skin"}],
    )
    uvs = scene.accessor([[0, 0], [1, 0], [0, 0.5]])
    scene.node(mesh=scene.mesh(attributes={"TEXCOORD_0": uvs}, material=0))
    scene.node(mesh=scene.mesh())
    return scene
