"""A curve graph from a surface's edge graph, by the local separators of PyGEL3D.

Source: Bærentzen and Rotenberg 2021, "Skeletonization via Local Separators", ACM TOG 40(5), as
implemented by PyGEL3D.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np

from solvers.skeleton.space_graph import FloatArray, IntArray, SpaceGraph


def local_separators(surface: SpaceGraph) -> tuple[FloatArray, IntArray]:
    """Return nodes (n, 3) and edges (e, 2) of the curve graph that PyGEL3D finds.

    Every vertex is a start: PyGEL3D's sampling uses the system's random device and would give
    another graph at each call.

    Raises:
        ImportError: PyGEL3D is not installed.
    """
    try:
        from pygel3d import graph  # noqa: PLC0415  # an optional extra
    except ImportError as error:
        raise ImportError("curve skeletons need: pip install 'bunraku[characters]'") from error
    network = graph.Graph()
    for point in surface.positions:
        network.add_node(point)
    for a, b in surface.edges.tolist():
        network.connect_nodes(a, b)
    with _quiet_stdout():
        skeleton = graph.LS_skeleton(network, sampling=False)
    skeleton.cleanup()
    nodes = list(skeleton.nodes())
    if not nodes:
        return np.empty((0, 3)), np.empty((0, 2), dtype=np.int64)
    edges = [(a, b) for a in nodes for b in skeleton.neighbors(a) if a < b]
    positions = np.array(skeleton.positions(), dtype=np.float64)
    return positions, np.array(sorted(edges), dtype=np.int64).reshape(-1, 2)


@contextmanager
def _quiet_stdout() -> Iterator[None]:
    """Suppress output of C++ to descriptor 1, where PyGEL3D prints its progress."""
    try:
        kept = os.dup(1)
    except OSError:  # a service without standard output
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        with suppress(OSError, AttributeError, TypeError):
            ctypes.CDLL(None).fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
