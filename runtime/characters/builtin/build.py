"""Mesh the built-in characters: ``python -m runtime.characters.builtin.build [NAME ...]``.

Needs the extra `characters`. The same machine writes the same bytes every time; another one may
differ in the last digits of the positions.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from runtime.characters.builtin import cactus, mannequin, paper, squid, trex
from runtime.characters.builtin.meshing import meshed
from runtime.characters.builtin.sculpture import Sculpture, grow, painted

SCULPTORS: dict[str, Callable[[], Sculpture]] = {
    "squid": squid.sculpt,
    "cactus": cactus.sculpt,
    "trex": trex.sculpt,
    "paper": paper.sculpt,
    "mannequin": mannequin.sculpt,
}


def built(sculpture: Sculpture) -> dict[str, NDArray[np.generic]]:
    """The stored arrays of a character: its mesh on the ground, colours (n, 3) and skeleton."""
    vertices, faces = meshed(sculpture)
    colors = painted(sculpture, vertices, crispness=0.03 * sculpture.edge)
    skeleton = grow(sculpture.limbs)
    drop = np.array([0.0, vertices[:, 1].min(), 0.0])
    return {
        "vertices": (vertices - drop).astype(np.float32),
        "faces": faces.astype(np.int32),
        "colors": np.round(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8),
        "node_names": np.array(skeleton.names),
        "node_parents": skeleton.parents.astype(np.int32),
        "node_positions": skeleton.rest_positions - drop,
    }


def main() -> None:
    """Write ``meshes/NAME.npz`` of each character named on the command line, or of all."""
    parser = argparse.ArgumentParser(description="Mesh the built-in characters.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SCULPTORS))
    folder = Path(__file__).parent / "meshes"
    folder.mkdir(exist_ok=True)
    for name in parser.parse_args().names or SCULPTORS:
        np.savez_compressed(folder / f"{name}.npz", **built(SCULPTORS[name]()))  # type: ignore[arg-type]  # numpy declares its keywords as flags as well


if __name__ == "__main__":
    main()
