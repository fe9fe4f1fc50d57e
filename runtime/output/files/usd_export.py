"""Export of the exact performed surface as a USD mesh with time samples."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.characters.character import Character, Surface
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file
from runtime.output.output import PerformedFrame


class UsdExport:
    """Writes ``/Character/Surface``, with the exact points of every frame.

    Coordinates are those of the stage: metres, +Y up. Vertices and faces are those of the
    character's file, in its order. Colours, textures included, are sampled at the vertices into
    ``displayColor``; texture coordinates are kept as ``primvars:st``. Time codes count frames at
    `rate`, and each frame has its own time, so jitter and gaps are kept.

    The file is written at the end, in one piece.

    Args:
        path: ends in .usda (text) or .usdc (binary).
        character: the performed character.
        rate: time codes per second.

    Raises:
        InputError: the suffix is unknown, usd-core is missing, or the file cannot be written.
    """

    pictures_a_second = 0.0

    def __init__(self, path: Path, character: Character, *, rate: float = 30.0) -> None:
        self._suffix = check_suffix(path, (".usda", ".usdc"))
        check_writable(path)
        self._pxr = _import_pxr(path)
        self._path = path
        self._rate = rate
        self._vertex = character.surface.vertex
        self._start: float | None = None
        self._last = 0.0  # the newest time code
        self._layer = self._pxr.Sdf.Layer.CreateAnonymous(self._suffix)
        self._stage = self._pxr.Usd.Stage.Open(self._layer)
        self._mesh = self._describe(character)

    def write(self, frame: PerformedFrame) -> None:
        """Store one frame; of several frames at one time, the last one is kept."""
        if self._start is None:
            self._start = frame.time
        self._last = round((frame.time - self._start) * self._rate, 6)
        self._put_points(self._mesh, frame.vertices[self._vertex], self._last)

    def close(self) -> None:
        """Write the file; a show without frames gives the rest pose.

        Raises:
            InputError: the disk fails.
        """
        if self._layer is None:
            return
        layer, self._layer = self._layer, None
        self._stage.SetStartTimeCode(0.0)
        self._stage.SetEndTimeCode(self._last)
        with whole_file(self._path) as path:
            try:
                layer.Export(str(path))
            except self._pxr.Tf.ErrorException as error:
                raise OSError(_first_reason(str(error))) from error

    def _describe(self, character: Character) -> Any:
        """Author everything that does not change during the show."""
        geometry = self._pxr.UsdGeom
        geometry.SetStageUpAxis(self._stage, geometry.Tokens.y)
        geometry.SetStageMetersPerUnit(self._stage, 1.0)
        self._stage.SetTimeCodesPerSecond(self._rate)
        self._stage.SetFramesPerSecond(self._rate)
        root = geometry.Xform.Define(self._stage, "/Character")
        root.GetPrim().SetDisplayName(character.name)
        self._stage.SetDefaultPrim(root.GetPrim())
        mesh = geometry.Mesh.Define(self._stage, "/Character/Surface")
        faces = np.ascontiguousarray(character.surface.faces, np.int32)
        ints = self._pxr.Vt.IntArray.FromNumpy
        mesh.CreateFaceVertexCountsAttr(ints(np.full(len(faces), 3, np.int32)))
        mesh.CreateFaceVertexIndicesAttr(ints(faces.ravel()))
        mesh.CreateSubdivisionSchemeAttr(geometry.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        self._put_points(mesh, character.vertices[self._vertex], None)
        self._paint(mesh, character.surface)
        return mesh

    def _paint(self, mesh: Any, surface: Surface) -> None:
        """Author colours, texture coordinates, and opacity if anything is transparent."""
        geometry, arrays = self._pxr.UsdGeom, self._pxr.Vt
        vertex = geometry.Tokens.vertex
        colors = vertex_colors(surface)
        shown = arrays.Vec3fArray.FromNumpy(np.ascontiguousarray(colors[:, :3]))
        mesh.CreateDisplayColorPrimvar(vertex).Set(shown)
        if (colors[:, 3] < 1).any():
            opacity = arrays.FloatArray.FromNumpy(np.ascontiguousarray(colors[:, 3]))
            mesh.CreateDisplayOpacityPrimvar(vertex).Set(opacity)
        if surface.uvs is not None:
            upward = np.nan_to_num(surface.uvs) * (1, -1) + (0, 1)  # USD's v points up
            kind = self._pxr.Sdf.ValueTypeNames.TexCoord2fArray
            primvar = geometry.PrimvarsAPI(mesh).CreatePrimvar("st", kind, vertex)
            primvar.Set(arrays.Vec2fArray.FromNumpy(upward.astype(np.float32)))

    def _put_points(self, mesh: Any, points: NDArray[np.float64], time: float | None) -> None:
        """Author points (M, 3) and their extent, at a time code or as the default value."""
        written = np.ascontiguousarray(points, np.float32)
        extent = np.stack([written.min(axis=0), written.max(axis=0)])
        at = self._pxr.Usd.TimeCode.Default() if time is None else time
        mesh.CreatePointsAttr().Set(self._pxr.Vt.Vec3fArray.FromNumpy(written), at)
        mesh.CreateExtentAttr().Set(self._pxr.Vt.Vec3fArray.FromNumpy(extent), at)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def vertex_colors(surface: Surface) -> NDArray[np.float32]:
    """Return linear RGBA (M, 4) per file vertex: vertex colour times material and texture colour.

    A vertex on the border of two materials takes the later material.
    """
    tints = np.ones((len(surface.vertex), 4), np.float32)
    for index, material in enumerate(surface.materials):
        used = np.unique(surface.faces[surface.face_material == index])
        tints[used] = np.clip(np.nan_to_num(material.color, nan=1.0), 0.0, 1.0)
        if material.texture is not None and surface.uvs is not None:
            tints[used] *= _sampled(material.texture, surface.uvs[used])
    own = np.clip(np.nan_to_num(surface.colors, nan=1.0), 0.0, 1.0)
    colors: NDArray[np.float32] = (own * tints).astype(np.float32)
    return colors


def _sampled(texture: NDArray[np.uint8], uvs: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sample a repeating sRGB texture (h, w, 4) at the nearest pixels: linear RGBA (n, 4)."""
    height, width = texture.shape[:2]
    place = np.nan_to_num(uvs) % 1.0
    row = np.minimum((place[:, 1] * height).astype(int), height - 1)
    column = np.minimum((place[:, 0] * width).astype(int), width - 1)
    pixels: NDArray[np.float32] = texture[row, column].astype(np.float32) / 255
    encoded = pixels[:, :3]
    pixels[:, :3] = np.where(  # IEC 61966-2-1
        encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4
    )
    return pixels


def _first_reason(message: str) -> str:
    """Extract the system's reason from the error stack of the USD library."""
    quoted = re.search(r" : '(.*)'$", message, re.MULTILINE)
    return quoted[1] if quoted else "the USD library could not save it"


def _import_pxr(path: Path) -> Any:
    try:
        import pxr  # noqa: PLC0415  # an optional extra
        from pxr import Sdf, Tf, Usd, UsdGeom, Vt  # noqa: F401, PLC0415  # an optional extra, checked before the show
    except ImportError as error:
        raise InputError(
            f"cannot write {path}: USD needs the extra: pip install 'bunraku[usd]'"
        ) from error
    return pxr
