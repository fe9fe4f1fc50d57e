"""A body whose joints are known, the markers on its skin, and files of them."""

from __future__ import annotations

import struct

import numpy as np

from replay.builtin import builtin_recording

UP_Z = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
"""From +Y up to +Z up, as most laboratories have it."""


def joints_of(frames: int = 60) -> dict[str, np.ndarray]:
    """The joints (T, 3) [m] of a body that walks, by the names that readers give them."""
    walk = builtin_recording("walk")
    every = np.arange(frames) % len(walk)
    named = {
        "Head": "Head",
        "Neck": "SpineShoulder",
        **{
            side + ours: own + side
            for side in ("Left", "Right")
            for ours, own in (
                ("UpperLeg", "Hip"),
                ("LowerLeg", "Knee"),
                ("Foot", "Ankle"),
                ("Toes", "Foot"),
                ("UpperArm", "Shoulder"),
                ("LowerArm", "Elbow"),
                ("Hand", "Wrist"),
            )
        },
    }
    joints = {
        name: walk.positions[every, walk.skeleton.index(joint)] for name, joint in named.items()
    }
    shoulders = joints["LeftUpperArm"] + joints["RightUpperArm"]
    return joints | {"UpperChest": shoulders / 2, "Neck": joints["Neck"] + [0.0, 0.04, 0.0]}


def markers_of(joints: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Markers (T, 3) of Plug-in Gait with medial ones, around joints that they tell exactly.

    The pelvis is the one whose hips lie as Bell et al. 1990 say.
    """
    left, right = joints["LeftUpperLeg"], joints["RightUpperLeg"]
    apart = float(np.median(np.linalg.norm(left - right, axis=1)))
    across = (left - right) / np.linalg.norm(left - right, axis=1, keepdims=True)
    up = np.tile([0.0, 1.0, 0.0], (len(left), 1))
    up -= (up * across).sum(axis=1, keepdims=True) * across
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    forward = np.cross(across, up)
    width = apart / 0.72
    front = (left + right) / 2 + width * (0.22 * forward + 0.30 * up)
    markers = {
        "LASI": front + across * width / 2,
        "RASI": front - across * width / 2,
        "LPSI": front - forward * 0.9 * width + across * 0.2 * width,
        "RPSI": front - forward * 0.9 * width - across * 0.2 * width,
        "C7": joints["Neck"] - forward * 0.06,
        "CLAV": joints["Neck"] + forward * 0.06,
    }
    corners = (("F", 1.0), ("B", -1.0))
    for side, sign in (("L", 1.0), ("R", -1.0)):
        own = {"L": "Left", "R": "Right"}[side]
        for end, ahead in corners:
            markers[f"{side}{end}HD"] = (
                joints["Head"] + across * sign * 0.07 + forward * ahead * 0.09
            )
        for name, joint, half in (
            ("KNE", "LowerLeg", 0.06),
            ("ANK", "Foot", 0.04),
            ("ELB", "LowerArm", 0.04),
        ):
            markers[side + name] = joints[own + joint] + across * sign * half
            markers[side + name + "M"] = joints[own + joint] - across * sign * half
        for name, ahead in (("WRA", 1.0), ("WRB", -1.0)):
            markers[side + name] = joints[own + "Hand"] + forward * ahead * 0.03
        markers[side + "TOE"] = joints[own + "Toes"]
        markers[side + "HEE"] = joints[own + "Foot"] - forward * 0.05
        markers[side + "SHO"] = joints[own + "UpperArm"]
    hips = (left + right) / 2
    tops = markers["LSHO"], markers["RSHO"]
    # The joint lies 17 % of the acromions' distance below them, towards the hips.
    lift = float(np.median(np.linalg.norm(tops[0] - tops[1], axis=1))) * 0.17
    for _ in range(40):
        middle = (markers["LSHO"] + markers["RSHO"]) / 2
        down = (hips - middle) / np.linalg.norm(hips - middle, axis=1, keepdims=True)
        markers["LSHO"] = joints["LeftUpperArm"] - down * lift
        markers["RSHO"] = joints["RightUpperArm"] - down * lift
    return markers


def marked() -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Joints and markers (T, 3) [m] of a body, +Y up."""
    joints = joints_of()
    return joints, markers_of(joints)


def c3d_bytes(
    markers: dict[str, np.ndarray],
    *,
    unit: str = "mm",
    factor: float = 1000.0,
    rate: float = 120.0,
    scale: float = -1.0,
    screen: tuple[str, str] = ("+X", "+Z"),
    processor: int = 84,
    analogue: int = 0,
) -> bytes:
    """A C3D file as the User Guide lays it out; markers that are NaN have a residual of -1."""
    order = ">" if processor == 86 else "<"
    names = list(markers)
    places = np.stack(list(markers.values()), axis=1) * factor
    frames, count = places.shape[:2]
    seen = np.isfinite(places).all(axis=2)
    points = np.zeros((frames, count, 4))
    points[..., :3] = np.where(seen[..., None], places, 0.0)
    if scale > 0:
        points[..., :3] = np.round(points[..., :3] / scale)
    points[..., 3] = np.where(seen, 0.0, -1.0)
    table = np.concatenate([points.reshape(frames, -1), np.ones((frames, analogue))], axis=1)
    body = _numbers(table, order + ("i2" if scale > 0 else "f4"), processor)

    def real(value: float) -> bytes:
        return _numbers(np.array([value]), order + "f4", processor)

    width = max(map(len, names))
    parameters = [
        _group(order, 1, "POINT"),
        _parameter(order, 1, "USED", 2, (), struct.pack(order + "H", count)),
        _parameter(order, 1, "SCALE", 4, (), real(scale)),
        _parameter(order, 1, "RATE", 4, (), real(rate)),
        _parameter(order, 1, "FRAMES", 2, (), struct.pack(order + "H", frames)),
        _parameter(order, 1, "DATA_START", 2, (), struct.pack(order + "H", 0)),
        _parameter(order, 1, "UNITS", -1, (len(unit),), unit.encode()),
        _parameter(order, 1, "X_SCREEN", -1, (2,), screen[0].encode()),
        _parameter(order, 1, "Y_SCREEN", -1, (2,), screen[1].encode()),
        _parameter(
            order, 1, "LABELS", -1, (width, count), "".join(n.ljust(width) for n in names).encode()
        ),
        _parameter(order, 1, "DESCRIPTIONS", -1, (1, count), b" " * count),
        _group(order, 2, "ANALOG"),
        _parameter(order, 2, "USED", 2, (), struct.pack(order + "H", analogue)),
        _parameter(order, 2, "RATE", 4, (), real(rate if analogue else 0.0)),
    ]
    section = b"".join(parameters) + b"\0\0"
    blocks = -(-(len(section) + 4) // 512)
    section = struct.pack("BBBB", 1, 0x50, blocks, processor) + section
    start = 2 + blocks
    head = struct.pack(order + "HHHHH", count, analogue, 1, frames, 10) + real(scale)
    head += struct.pack(order + "HH", start, 1 if analogue else 0) + real(rate)
    return b"".join(
        part.ljust(-(-len(part) // 512) * 512, b"\0")
        for part in (b"\x02\x50" + head, section, body)
    )


def _numbers(values: np.ndarray, kind: str, processor: int) -> bytes:
    if processor != 85 or not kind.endswith("f4"):
        return values.astype(kind).tobytes()
    words = (values.astype("<f4") * np.float32(4)).view("<u2").reshape(-1, 2)
    return words[:, ::-1].tobytes()


def _group(order: str, number: int, name: str) -> bytes:
    return struct.pack("bb", len(name), -number) + name.encode() + struct.pack(order + "hB", 3, 0)


def _parameter(
    order: str, group: int, name: str, kind: int, dimensions: tuple[int, ...], data: bytes
) -> bytes:
    body = struct.pack("bB", kind, len(dimensions)) + bytes(dimensions) + data + b"\0"
    head = struct.pack("bb", len(name), group) + name.encode()
    return head + struct.pack(order + "h", len(body) + 2) + body


def trc_text(
    markers: dict[str, np.ndarray],
    *,
    unit: str = "mm",
    factor: float = 1000.0,
    rate: float = 100.0,
) -> str:
    """A TRC file as OpenSim lays it out; cells of markers that are NaN are empty."""
    frames = len(next(iter(markers.values())))
    columns = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate".split()
    lines = [
        "PathFileType\t4\t(X/Y/Z)\twalk.trc",
        "\t".join(columns),
        f"{rate:.2f}\t{rate:.2f}\t{frames}\t{len(markers)}\t{unit}\t{rate:.2f}",
        "Frame#\tTime\t" + "\t\t\t".join(markers) + "\t\t",
        "\t\t" + "\t".join(f"{a}{k}" for k in range(1, len(markers) + 1) for a in "XYZ"),
        "",
    ]
    for frame in range(frames):
        cells = [
            "" if np.isnan(value) else f"{factor * value:.5f}"
            for marker in markers.values()
            for value in marker[frame]
        ]
        lines.append("\t".join([str(frame + 1), f"{frame / rate:.6f}", *cells]))
    return "\n".join([*lines, ""])
