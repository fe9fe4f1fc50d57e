"""Read Azure Kinect CSV files with one column per joint and "x y z" in each cell (GymTrainer).

Source: carlge/Azure-kinect-GymTrainer. A header names the joints; camera metres, Y down; no time
and no confidence.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from devices.errors import InputError
from devices.kinect.joints import AZURE_TO_WORLD, KINECT_AZURE
from replay.kinect.camera_recording import KINECT_RATE, camera_recording
from replay.kinect.text_rows import first_rows, read_lines
from replay.recording import Recording

_MILLIMETRES_FROM = 50.0  # units of distance from which the unit cannot be metres


def recognises_azure_csv(_path: Path, head: bytes) -> bool:
    """Whether the first line names the joints of Azure Kinect, one per column."""
    rows = first_rows(head, ",")
    return bool(rows) and {"Pelvis", "SpineNavel", "SpineChest"} <= _columns(rows[0]).keys()


def read_azure_csv(path: Path) -> Recording:
    """Read an Azure Kinect CSV, one frame per line at 30 per second; millimetres are detected.

    Raises:
        InputError: a joint has no column, or a cell is not three numbers.
    """
    notes: list[str] = ["no times in the file: 30 frames a second (--fps-input N)"]
    lines = [(at, line) for at, line in enumerate(read_lines(path), 1) if line.strip()]
    columns = _columns(lines[0][1].split(",") if lines else [])
    missing = [name for name in KINECT_AZURE.names if name not in columns]
    if missing:
        raise InputError(f"{path}, line 1: no column is called {missing[0]!r}")
    frames = []
    for at, line in lines[1:]:
        try:
            frames.append(np.array(_joints(line.split(","), columns)))
        except (ValueError, IndexError) as error:
            if frames and at == lines[-1][0]:
                notes.append("the last line is truncated and was omitted")
                continue
            raise InputError(f"{path}, line {at}: expected cells of three numbers") from error
    if not frames:
        raise InputError(f"{path}: holds no frame")
    positions = np.array(frames)
    away = np.abs(positions[..., 2])
    if np.median(away[np.isfinite(away)] if np.isfinite(away).any() else 0.0) > _MILLIMETRES_FROM:
        notes.append("unit guessed: millimetres")
        positions = positions / 1000.0
    return camera_recording(
        path,
        KINECT_AZURE,
        AZURE_TO_WORLD,
        times=np.arange(len(positions), dtype=np.float64) / KINECT_RATE,
        positions=positions,
        confidence=np.ones(positions.shape[:2]),
        notes=notes,
    )


def _columns(header: list[str]) -> dict[str, int]:
    return {name.strip().strip('"'): column for column, name in enumerate(header)}


def _joints(cells: list[str], columns: dict[str, int]) -> list[tuple[float, float, float]]:
    joints = []
    for name in KINECT_AZURE.names:
        x, y, z = (float(word) for word in cells[columns[name]].strip('" ').split())
        joints.append((x, y, z))
    return joints
