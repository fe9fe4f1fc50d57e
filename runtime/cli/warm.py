"""Compile all kernels that a show can reach before it begins, once, in two processes.

The kernels of the solvers are compiled in a process of their own, all others in this one. A list
of the files that each part needs is kept beside them, so that a later start only looks them up.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numba.core import event
from numpy.typing import NDArray

from devices.bridge.messages import LATEST
from devices.bridge.receiver import BridgeReceiver
from devices.osc.vmc_decoder import VmcDecoder
from replay.builtin import builtin_recording
from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.open_character import load_character
from runtime.characters.proxy import proxy_of
from runtime.driving.performer import Performer
from runtime.puppet.deformable_surface import Elasticity
from runtime.render.normals import DeformingNormals, bounding_box, split_vertices
from runtime.show.messages import say
from runtime.show.open_stream import play
from runtime.show.settings import CharacterSettings, ShowSettings
from runtime.show.show import Show
from runtime.status.progress import Progress
from solvers.arap import ENERGIES
from solvers.deform.skinning import SkinnedSurface
from solvers.editing.clips_on_chains import LaidClip, with_clip
from solvers.editing.motion import Clip, Motion
from solvers.editing.part import part_of
from solvers.editing.part_pose import pose_at
from solvers.kernels.cache import count_compiled, has_list, remove_unused, save_list
from solvers.linear.block_factor import BlockFactor
from solvers.linear.nested_dissection import dissect
from solvers.retarget.limb_posing import lift_segments
from solvers.retarget.two_bone_ik import two_bone_turns
from solvers.skeleton.layers import LayeredNodes, LayerFrame
from solvers.skeleton.tree import Tree
from solvers.squash_stretch import SquashStretchSolver
from solvers.surface.heat_weights import skin_of_heat
from solvers.surface.ray_hit import ray_hit

# What the two lists are of; after a change in this module they are made again.
_THIS = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:8]
_SOLVERS, _SHOW = f"solvers-{_THIS}", f"show-{_THIS}"
_NOT_SHOWN = "runtime.benchmarks"
_FRAMES = 3
_LOOK = 0.5  # [s] between two counts while the other process compiles


def warm_up() -> None:
    """Compile every kernel that a show can reach and that is not in the cache."""
    if has_list(_SOLVERS, _NOT_SHOWN) and has_list(_SHOW, _NOT_SHOWN):
        return
    say("compiling kernels, once: a minute or two on two free cores")
    with _process_of_solvers() as solvers, _shown() as compiled:
        _use_decoders_and_surfaces()
        while solvers.poll() is None:
            with suppress(subprocess.TimeoutExpired):
                solvers.wait(_LOOK)
            compiled.look()
        _perform()
        compiled.look()
    save_list(_SHOW, _NOT_SHOWN)
    remove_unused()


@contextmanager
def _process_of_solvers() -> Iterator[subprocess.Popen[bytes]]:
    """Compile the solvers' kernels in another process, which ends with the block at the latest."""
    with subprocess.Popen([sys.executable, "-m", "runtime.cli.warm"]) as solvers:
        try:
            yield solvers
        finally:
            solvers.terminate()


class _Compiled(event.Listener):
    """Shows how many kernels are compiled, each time that this process has compiled one."""

    def __init__(self) -> None:
        self._done, total = count_compiled(_NOT_SHOWN)
        self.progress = Progress("compiling", total, unit="kernels")
        self.progress.advance(self._done)

    def look(self) -> None:
        """Count the kernels of all processes."""
        done, _ = count_compiled(_NOT_SHOWN)
        self.progress.advance(done - self._done)
        self._done = done

    def on_start(self, event: object) -> None:
        """Nothing is compiled yet."""

    def on_end(self, event: object) -> None:
        """A kernel is compiled."""
        self.look()


@contextmanager
def _shown() -> Iterator[_Compiled]:
    compiled = _Compiled()
    with compiled.progress, event.install_listener("numba:compile", compiled):
        yield compiled


def use_solvers() -> None:
    """Solve once in each way that a show can ask for."""
    side = 9
    grid = np.stack(np.meshgrid(np.arange(float(side)), np.arange(float(side)), [0.0]), axis=-1)
    x = grid.reshape(-1, 3)
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate(
        [np.stack([a, a + 1, a + side + 1], 1), np.stack([a, a + side + 1, a + side], 1)]
    )
    corners = np.array([0, side - 1, side * (side - 1), side * side - 1])
    for energy in ENERGIES:
        solver = SquashStretchSolver(x, faces, corners, energy=energy, groups=[0, 0, 1, 2])
        solver.stiffen(np.zeros(len(x), dtype=np.int64), np.ones(len(x)))
        for elasticity in (
            Elasticity(),
            Elasticity(cartoon=1.0, volume_gain=1.5),
            Elasticity(cartoon=1.0, stiffness=0.5),
            Elasticity(stiffness=0.5),
        ):
            solver.cartoon, solver.volume_gain = elasticity.cartoon, elasticity.volume_gain
            solver.stiffness = elasticity.stiffness
            answer = solver.solve(x[corners][::-1], 2)  # a jump
            solver.flatten_folds(answer)
            solver.settle()
        solver.weigh([np.inf, 1.0, 0.0, 0.5])
        solver.solve(x[corners], 1)
        before = solver.snapshot()
        solver.hold(corners[:3], groups=[0, 1, 2])
        solver.solve(x[corners[:3]], 1)
        solver.restore(before)
    _factor_in_double()
    _skin(x, faces)
    two_bone_turns(np.eye(3)[None], np.ones((1, 3)), np.ones((1, 3)))  # where a foot slides only
    unturned = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    link, joints, aside = np.array([0]), np.array([0, 1]), np.array([1.0, 0.0, 0.0])
    lift_segments(x[:2], unturned, link, joints, 0.5, aside, unturned)  # where wings hang only
    _stack_layers(Tree(np.array([-1, 0]), x[:2]))
    _pose_part(x[:2])
    ray_hit(x, faces, (0.5, 0.5, 1.0), (0.0, 0.0, -1.0))  # where something is clicked on


def _stack_layers(tree: Tree) -> None:
    """Put layers of both kinds on two nodes, as a session does."""
    layered, nodes = LayeredNodes(tree), np.arange(len(tree))
    turns = np.tile(np.array([0.0, 0.0, 0.0, 1.0], np.float32), (len(tree), 1))
    shifts = np.zeros((len(tree), 3), np.float32)
    frame = LayerFrame(nodes, (turns, turns), (shifts, shifts))
    layered.override(frame, 0.5)
    layered.add(frame, 0.5)
    layered.local(*layered.world())


def _pose_part(points: NDArray[np.float64]) -> None:
    """Pose a bone that plays two clips at once, as one does whose character was edited."""
    still = np.tile(np.array([0.0, 0.0, 0.0, 1.0]), (1, 2, 1))
    clip = Clip(Motion(np.zeros(1), np.array([0.0, 1.0]), still))
    part = part_of(points, np.array([-1, 0]))
    for _ in range(2):
        part = with_clip(part, (0, 1), LaidClip(clip, 0.0, 1.0))
    pose_at(part, 0.0)


def _skin(points: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    """Let a surface follow two nodes by a skin found for it."""
    nodes = points[[0, len(points) // 2, -1]]
    skin = skin_of_heat(points, faces, np.array([-1, 0, 1]), nodes)
    SkinnedSurface(points, nodes, skin).place(nodes, np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)))


def _factor_in_double() -> None:
    """Solve a chain that is fixed by next to nothing, for which single precision does not do."""
    count = 400
    link = -np.ones(count - 1)
    matrix = sp.diags([link, np.r_[1.0 + 1e-13, np.full(count - 2, 2.0), 1.0], link], [-1, 0, 1])
    points = np.arange(3.0 * count).reshape(count, 3)
    tree = dissect(matrix.tocsr(), points)
    factor = BlockFactor(sp.csr_matrix(matrix.tocsr()[tree.order][:, tree.order]), tree)
    factor.solve(points, np.empty_like(points))


def _use_decoders_and_surfaces() -> None:
    """Use everything of a show that needs no solver."""
    VmcDecoder()
    BridgeReceiver(LATEST)
    Performer(builtin_recording().skeleton)
    character = builtin_character(BUILTIN[0])
    proxy = proxy_of(character, dense=0, count=1_000)  # as for a dense character
    proxy.follow(proxy.vertices)
    DeformingNormals(split_vertices(character)).fill(character.vertices)
    bounding_box(character.vertices)


def _perform() -> None:
    """Perform a few frames with every built-in character."""
    characters = [load_character(name) for name in BUILTIN]
    elastic = CharacterSettings(cartoon=1.0, volume_gain=1.5, stiffness=0.5)
    settings = ShowSettings(characters=(elastic, *[CharacterSettings()] * (len(characters) - 1)))
    with Show(play(builtin_recording(), every_frame=True), characters, settings) as show:
        for _ in range(_FRAMES):
            show.tick()


if __name__ == "__main__":
    use_solvers()
    save_list(_SOLVERS, _NOT_SHOWN)
