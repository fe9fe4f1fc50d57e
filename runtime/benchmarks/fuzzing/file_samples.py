"""Small valid files for the fuzzer: recordings, characters, pictures, a mapping."""

from __future__ import annotations

import base64
import io
import json
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from devices.skeleton import Skeleton, SkeletonFrame
from replay.joint_table import write_joint_table
from replay.mcap.writer import McapWriter
from replay.recording import Recording
from replay.studio.smpl import ORDER
from runtime.benchmarks.fuzzing.mcap_samples import plain_mcap

MAPPING = json.dumps(
    {"pairs": [{"source": ["SpineBase", "SpineMid", "Head"], "target": [0, 1, 2], "flip": False}]}
).encode()
TEXTURED = (
    "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n"
)
_BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 30 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.033333
0 90 0 0 0 0 10 0 0
1 90 0 0 5 0 20 0 -4.5
2 91 0.5 0 10 0 30 1e-3 0
"""
_OBJ = """mtllib none.mtl
o body
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 0 1 0 0 0 1
v 0 0 1
vt 0 0
vt 1 0.5
vn 0 0 1
usemtl skin
s off
f 1/1/1 2/2/1 3/1/1
f 1//1 2//1 4//1
f -1 -2 -3
f 1 2 3 4
"""
_PLY = """ply
format ascii 1.0
comment made by hand
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
1 0 0 0 255 0
0 1 0 0 0 255
0 0 1 9 9 9
3 0 1 2
4 0 1 2 3
"""
SKELETON = b"""# AST/ASF file
:units
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name thorax
    direction 0 1 0
    length 8
    axis 0 0 20 XYZ
    dof rx ry rz
  end
  begin
    id 2
    name head
    direction 0 1 0
    length 4
    axis 0 0 0 XYZ
    dof rx
  end
:hierarchy
  begin
    root thorax
    thorax head
  end
"""
"""The skeleton of `MOTION`."""

MOTION = b"""#!OML:ASF a.asf
:FULLY-SPECIFIED
:DEGREES
1
root 0 15 0 0 0 0
thorax 0 1 2
head 3
2
root 1 15 0.5 0 10 1e-3
thorax 4 5 6
head -7.5
"""
_STL = """solid a
 facet normal 0 0 1
  outer loop
   vertex 0 0 0
   vertex 1 0 0
   vertex 0 1.5e0 0
  endloop
 endfacet
endsolid a
"""
_MEDIT = """MeshVersionFormatted 1
Dimension 3
Vertices
4
0 0 0 1
1 0 0 1
0 1 0 1
0 0 1 1
Triangles
2
1 2 3 1
1 2 4 1
Tetrahedra
1
1 2 3 4 1
End
"""


def recording_samples(folder: Path) -> Iterator[tuple[str, bytes]]:
    """The name and content of a recording of each format that can be written here.

    Args:
        folder: for a file that is made and removed.
    """
    skeleton = Skeleton(("root", "hand"), np.array([-1, 0]), np.eye(3)[:2])
    places = np.arange(18.0).reshape(3, 2, 3) / 10
    yield "bvh.bvh", _BVH.encode()
    made = folder / "made.mcap"
    with McapWriter(made, skeleton) as writer:
        for number, pose in enumerate(places):
            writer.write(SkeletonFrame(number / 30, pose, None, np.ones(2), arrival=number / 30))
    yield "mcap.mcap", made.read_bytes()
    made.unlink()
    yield "plain.mcap", plain_mcap(skeleton, places)
    table = io.StringIO()
    times = np.arange(3) / 30
    one, seen = np.zeros(3, np.int64), np.ones((3, 2))
    write_joint_table(table, Recording(skeleton, times, places, None, seen, one, times))
    yield "table.csv", table.getvalue().encode()
    yield (
        "landmarks.json",
        json.dumps({"fps": 30, "frames": [_landmarks(k) for k in (0, 1)]}).encode(),
    )
    yield "landmarks.csv", _landmark_table().encode()
    yield "leap.json", json.dumps({"frames": [leap_message(k) for k in range(2)]}).encode()
    packed = io.BytesIO()
    poses = np.full((2, 3 * len(ORDER)), 0.1)
    np.savez(packed, poses=poses, trans=np.zeros((2, 3)), mocap_framerate=30.0, betas=np.zeros(4))
    yield "smpl.npz", packed.getvalue()
    yield "walk.gltf", json.dumps(_moving_nodes()).encode()


def character_samples() -> Iterator[tuple[str, bytes]]:
    """The name and content of a character of each format."""
    yield "obj.obj", _OBJ.encode()
    yield "ply.ply", _PLY.encode()
    yield "ply-binary.ply", _binary_ply()
    yield "stl.stl", _STL.encode()
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    yield "stl-binary.stl", bytes(80) + struct.pack("<I", 2) + triangle * 2
    yield "off.off", b"OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2 255 0 0\n4 0 1 2 3\n"
    yield "medit.mesh", _MEDIT.encode()
    document, content = _gltf()
    uri = f"data:application/octet-stream;base64,{base64.b64encode(content).decode()}"
    whole = document | {"buffers": [{"byteLength": len(content), "uri": uri}]}
    yield "gltf.gltf", json.dumps(whole, indent=1).encode()
    text = json.dumps(document | {"buffers": [{"byteLength": len(content)}]}).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(content), len(text), b"JSON")
    yield "glb.glb", head + text + struct.pack("<I4s", len(content), b"BIN\0") + content


def pictures() -> dict[str, bytes]:
    """Small pictures by kind; the program reads the first three."""
    pixels = np.linspace(0, 255, 8 * 8 * 3).astype(np.uint8).reshape(8, 8, 3)
    image = Image.fromarray(pixels)
    made = {}
    for kind in ("PNG", "JPEG", "WEBP", "GIF", "TIFF", "EPS", "ICNS", "ICO", "BMP", "TGA", "PCX"):
        saved = io.BytesIO()
        (image.resize((16, 16)) if kind == "ICNS" else image).save(saved, kind)
        made[kind.lower()] = saved.getvalue()
    made["ps"] = b"%!PS\n(a) (w) file dup (b) writestring closefile\nshowpage\n"
    return made


def leap_message(number: int) -> dict[str, object]:
    """A frame of Leap's service with a hand and its index finger."""
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    hand = {
        "id": 7, "type": "right", "confidence": 0.9, "palmPosition": [0, 200, 50],
        "palmNormal": [0, -1, 0], "direction": [0, 0, -1], "wrist": [0, 190, 120],
        "elbow": [0, 150, 350], "armBasis": axes,
    }  # fmt: skip
    ends = ("carp", "mcp", "pip", "dip", "btip", "tip")
    finger = {"id": 71, "handId": 7, "type": 1, "tool": False, "bases": [axes] * 4} | {
        f"{end}Position": [10, 200, 45 - 25 * k] for k, end in enumerate(ends)
    }
    stamp = 5_000_000 + 10_000 * number
    return {"id": number, "timestamp": stamp, "hands": [hand], "pointables": [finger]}


def person(frame: int = 0) -> list[list[float]]:
    """The 33 landmarks of a pose (x, y, z, visibility), head up."""
    return [[(-0.2 if k % 2 else 0.2), -0.8 + 0.05 * k + 0.01 * frame, 0.0, 0.9] for k in range(33)]


def _landmarks(frame: int) -> dict[str, object]:
    points = [dict(zip(("x", "y", "z", "visibility"), row, strict=True)) for row in person(frame)]
    return {"timestamp_ms": 33 * frame, "pose_world_landmarks": [points]}


def _moving_nodes() -> dict[str, object]:
    """A glTF document of two nodes: one moves along, the other turns, each by two keys."""
    keys = [0.0, 0.5, 0, 1, 0, 0, 1, 2, 0, 0, 0, 1, 0.6, 0, 0, 0.8]
    content = base64.b64encode(np.array(keys, dtype="<f4").tobytes()).decode()
    sizes = (("SCALAR", 0, 8), ("VEC3", 8, 24), ("VEC4", 32, 32))
    target = ("translation", "rotation")
    return {
        "asset": {"version": "2.0"},
        "nodes": [
            {"name": "hips", "translation": [0, 1, 0], "children": [1]},
            {"name": "spine", "translation": [0, 0.5, 0]},
        ],
        "animations": [
            {
                "samplers": [{"input": 0, "output": k, "interpolation": "LINEAR"} for k in (1, 2)],
                "channels": [
                    {"sampler": k, "target": {"node": k, "path": target[k]}} for k in (0, 1)
                ],
            }
        ],
        "accessors": [
            {"bufferView": k, "componentType": 5126, "count": 2, "type": sizes[k][0]}
            for k in range(3)
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": n} for _, at, n in sizes],
        "buffers": [{"byteLength": 64, "uri": f"data:;base64,{content}"}],
    }


def _landmark_table() -> str:
    names = [f"{axis}{k}" for k in range(33) for axis in ("x", "y", "z", "v")]
    rows = [",".join(f"{x:.3f}" for row in person(k) for x in row) for k in range(3)]
    return "\n".join([",".join(names), *rows, ""])


def _binary_ply() -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    return head.encode() + np.eye(3, dtype="<f4").tobytes() + struct.pack("<B3i", 3, 0, 1, 2)


def _gltf() -> tuple[dict[str, object], bytes]:
    """A skinned triangle with a morph target and a texture: the document and its buffer."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    inverse = np.broadcast_to(np.eye(4, dtype="<f4"), (2, 4, 4))
    parts = [
        (corners, 5126, "VEC3"),
        (np.array([0, 1, 2], "<u2"), 5123, "SCALAR"),
        (np.array([[0, 1, 0, 0]] * 3, "u1"), 5121, "VEC4"),
        (np.array([[0.5, 0.5, 0, 0]] * 3, "<f4"), 5126, "VEC4"),
        (inverse, 5126, "MAT4"),
        (0.1 * corners, 5126, "VEC3"),
        (corners[:, :2].copy(), 5126, "VEC2"),
    ]
    content, views, accessors = b"", [], []
    for values, component, kind in parts:
        data = values.tobytes()
        views.append({"buffer": 0, "byteOffset": len(content), "byteLength": len(data)})
        content += data + b"\0" * (-len(data) % 4)
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": component,
                "count": len(values),
                "type": kind,
            }
        )
    png = pictures()["png"]
    views.append({"buffer": 0, "byteOffset": len(content), "byteLength": len(png)})
    content += png + b"\0" * (-len(png) % 4)
    used = {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3, "TEXCOORD_0": 6}
    part = {"attributes": used, "indices": 1, "material": 0, "targets": [{"POSITION": 5}]}
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0, "skin": 0},
            {"name": "hips", "children": [2], "translation": [0, 1, 0]},
            {"name": "spine", "rotation": [0, 0, 0, 1]},
        ],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 4}],
        "meshes": [
            {"primitives": [part], "weights": [0.5], "extras": {"targetNames": ["jawOpen"]}}
        ],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 7, "mimeType": "image/png"}],
        "accessors": accessors,
        "bufferViews": views,
    }, content
