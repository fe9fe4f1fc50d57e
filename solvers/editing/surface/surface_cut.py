"""A surface is cut in two where a bone is cut, and both sides are closed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array, csr_array, vstack
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from solvers.editing.surface.blade import Blade, plane
from solvers.editing.surface.caps import filled, nested
from solvers.editing.surface.compacting import compact
from solvers.editing.surface.crossings import crossed_round
from solvers.editing.surface.rims import rim_edge, rims, sides
from solvers.editing.surface.sheet import Array, Derived, Flags, Indices, Sheet
from solvers.editing.surface.splitting import Split, split

_NEAR = 8  # vertices of the rim that a new one of the cap is made of


class _Cap(NamedTuple):
    """Fills one rim and its holes: rows of the split surface at the rim, and what is new.

    Attributes:
        ring: (r,) the rims' vertices.
        new: (p, 3) new vertices.
        made_of: (p, r) of the rims' vertices, rows sum to 1.
        triangles: (t, 3) into `ring` and then `new`, outward for the side below.
    """

    ring: Indices
    new: Array
    made_of: csr_array
    triangles: Indices


def across(start: ArrayLike, end: ArrayLike, share: float) -> Blade:
    """Return the plane across a bone, with the bone's end on its positive side.

    Args:
        start, end: (3,) of the bone.
        share: of the bone's length.

    Raises:
        ValueError: the bone has no length.
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    return plane(first + share * (last - first), last - first)


def share_of(blade: Blade, start: ArrayLike, end: ArrayLike) -> float:
    """Return where a blade crosses a bone, as a share of its length.

    Raises:
        ValueError: it does not.
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    shares = np.linspace(0.0, 1.0, 513)
    side = blade.side(first + shares[:, None] * (last - first))
    crossed = np.flatnonzero((side[:-1] < 0.0) != (side[1:] < 0.0))
    if not len(crossed):
        raise ValueError("the line does not cross the bone; draw it across")
    at = int(crossed[0])
    return float(shares[at] + (shares[1]) * side[at] / (side[at] - side[at + 1]))


def cut_surface(sheet: Sheet, blade: Blade, at: ArrayLike) -> tuple[Derived, Derived]:
    """Cut a surface round a point of a bone; return what is below the blade, and what comes off.

         ___________            ____    ______
        |     |     |          |    |  |      |
        |  ---+---  |    ->    |  --|  |---   |       both sides closed, each with its own cap
        |_____|_____|          |____|  |______|

    Only what goes round the point is cut, and what is nearer to it, not everything that a plane
    goes through. Closed surfaces stay closed. Open ones are closed at the rims that are. Vertices
    near the blade are moved onto it along an edge, so that no slivers stay. A cap has edges as long
    as those round it, and continues what its rim carries: what vertices carry smoothly, what copies
    carry as the nearest place of the rim has it, of one chart of the texture for each triangle.
    Where a chart meets itself at the rim, its texture is smeared over one row of triangles.

    Args:
        sheet: the surface, as it is seen where it is cut.
        blade: what cuts; what is on its positive side comes off.
        at: (3,) the point on the bone, on the blade.

    Raises:
        ValueError: nothing is there to be cut, it hangs together round the cut, or it is no clean
            surface there; in one line.
    """
    point = np.asarray(at, dtype=np.float64)
    chosen = crossed_round(sheet.vertices, sheet.triangles, blade, point)
    try:
        return _parted(split(sheet, blade, chosen), blade)
    except ValueError:
        # Moved vertices can make two rims touch that did not.
        return _parted(split(sheet, blade, chosen, snapped=0.0), blade)


def _parted(whole: Split, blade: Blade) -> tuple[Derived, Derived]:
    rings = rims(whole)
    off = sides(whole)
    flat = [blade.flat(whole.sheet.vertices[ring]) for ring in rings]
    caps = [
        _cap(whole, blade, [rings[k] for k in group], [flat[k] for k in group])
        for group in nested(flat)
    ]
    return _side(whole, ~off, caps, below=True), _side(whole, off, caps, below=False)


def _cap(whole: Split, blade: Blade, rings: Sequence[Indices], flat: Sequence[Array]) -> _Cap:
    ring = np.concatenate(list(rings))
    edge = rim_edge(whole.sheet.vertices, whole, ring)
    x = flat[0]
    after = np.roll(x, -1, axis=0)
    inverted = float((x[:, 0] * after[:, 1] - x[:, 1] * after[:, 0]).sum()) < 0.0
    mirror = np.array([-1.0, 1.0]) if inverted else np.ones(2)
    new, triangles = filled([each * mirror for each in flat], edge)
    made_of = _smoothly(np.concatenate(list(flat)), new * mirror)
    return _Cap(ring, blade.placed(new * mirror), made_of, triangles)


def _smoothly(rim: Array, new: Array) -> csr_array:
    """What each new vertex of a cap is made of: those of the rim that are near, by 1 / d^2."""
    count = min(_NEAR, len(rim))
    distance, nearest = KDTree(rim).query(new, k=[*range(1, count + 1)])
    shares = distance**-2.0
    shares /= shares.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(new)), count)
    shape = (len(new), len(rim))
    return csr_array(coo_array((shares.ravel(), (rows, nearest.ravel())), shape=shape))


def _side(whole: Split, mine: Flags, caps: Sequence[_Cap], *, below: bool) -> Derived:
    """The faces of one side with its caps, as a surface of its own."""
    faces, of_faces = [whole.sheet.faces[mine]], [whole.of_faces[mine]]
    of_vertices, of_copies = [whole.of_vertices], [whole.of_copies]
    vertices, vertex = [whole.sheet.vertices], [whole.sheet.vertex]
    triangles = whole.sheet.triangles
    charts = _charts(whole.sheet)
    seam = np.zeros(len(whole.sheet.vertices), dtype=np.bool_)
    for cap in caps:
        names = np.concatenate([cap.ring, sum(map(len, vertices)) + np.arange(len(cap.new))])
        seam[cap.ring] = True
        vertices.append(cap.new)
        of_vertices.append(csr_array(cap.made_of @ whole.of_vertices[cap.ring]))
        turned = cap.triangles if below else cap.triangles[:, ::-1]
        # Each triangle continues what the face beside it at the rim has, of its chart only.
        beside = np.flatnonzero(mine & (np.isin(triangles, cap.ring).sum(axis=1) >= 2))
        places = np.concatenate([whole.sheet.vertices[cap.ring], cap.new])
        middles = places[turned].mean(axis=1)
        source = beside[
            KDTree(whole.sheet.vertices[triangles[beside]].mean(axis=1)).query(middles)[1]
        ]
        of_faces.append(whole.of_faces[source])
        chart = charts[whole.sheet.faces[source, 0]]
        wanted, index = np.unique(
            np.stack([names[turned].ravel(), np.repeat(chart, 3)], axis=1),
            axis=0,
            return_inverse=True,
        )
        first = sum(map(len, vertex))
        faces.append(first + index.reshape(-1, 3))
        vertex.append(wanted[:, 0])
        everywhere = np.concatenate(vertices)
        rim_copies = np.unique(whole.sheet.faces[beside])
        rim_copies = rim_copies[np.isin(whole.sheet.vertex[rim_copies], cap.ring)]
        rows = np.zeros(len(wanted), dtype=np.int64)
        for each in np.unique(chart).tolist():
            those = rim_copies[charts[rim_copies] == each]
            here = wanted[:, 1] == each
            tree = KDTree(everywhere[whole.sheet.vertex[those]])
            rows[here] = those[tree.query(everywhere[wanted[here, 0]])[1]]
        of_copies.append(csr_array(whole.of_copies[rows]))
    added = sum(len(cap.new) for cap in caps)
    return compact(
        Derived(
            Sheet(np.concatenate(vertices), np.concatenate(vertex), np.concatenate(faces)),
            csr_array(vstack(of_vertices)),
            csr_array(vstack(of_copies)),
            np.concatenate(of_faces),
            np.concatenate([seam, np.ones(added, dtype=np.bool_)]),
        )
    )


def _charts(sheet: Sheet) -> Indices:
    """The number (M,) of the piece without seams that each copy is in."""
    rows, columns = sheet.faces[:, [0, 1]].ravel(), sheet.faces[:, [1, 2]].ravel()
    size = (len(sheet.vertex), len(sheet.vertex))
    links = coo_array((np.ones(len(rows)), (rows, columns)), shape=size)
    found: Indices = connected_components(links, directed=False)[1].astype(np.int64)
    return found
