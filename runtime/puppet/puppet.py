"""A character that a driver moves: its surface follows targets, and the whole stands on a stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from runtime.characters.character import Character
from runtime.characters.proxy import proxy_of
from runtime.driving.driver import Driver, Highlight
from runtime.driving.performer import Pose
from runtime.driving.targets import HandleTargets, Placement, PosedNodes, SkinnedTargets, Targets
from runtime.puppet.bound_skeleton import BoundSkeleton
from runtime.puppet.change_blend import ChangeBlend, ChangeBlendState
from runtime.puppet.deformable_surface import DeformableSurface, SurfaceState
from runtime.puppet.face import Face
from runtime.puppet.placement import Stance, put_on_stage
from runtime.puppet.travel import Travel, TravelState
from solvers.deform.arap_cells import SPOKES

Array = NDArray[np.float64]

FROM_REST = 4  # iterations towards a pose that is tried from the rest pose


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A character on the stage at one moment.

    Attributes:
        vertices: (N, 3) [m]; overwritten two motions later.
        nodes: its posed nodes; None if its driver poses none.
        weights: (T,) of its morph targets, which the vertices contain; None if it has none.
    """

    vertices: Array
    nodes: PosedNodes | None
    weights: Array | None = None


class Layers(Protocol):
    """Motion that is laid over a driver's targets."""

    @property
    def shows_driver(self) -> bool:
        """Whether the character moves as its driver says, so that highlights lie on it."""
        ...

    @property
    def seeks(self) -> bool:
        """Whether a match is looked for, so that what it would move lights up."""
        ...

    def over(self, targets: Targets, time: float) -> Targets:
        """Return the targets with that motion, for a frame at `time` [s]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PuppetState:
    """The state of a `Puppet` between two frames.

    Attributes:
        surface: of the deformable surface.
        targets: of the last frame.
        stance: of the last frame.
        layers: put more motion on what the driver says, as a session does; None for none.
        travel: how much of its way it goes.
        driver_kind: the class of the driver; None without one.
        driver: of the driver.
        face: (T,) the weights of the character's morph targets.
        change_blend: of the blend over live changes.
        shown: (N, 3) [m] the vertices as they were shown; None before.
    """

    surface: SurfaceState
    targets: Targets
    stance: Stance
    travel: TravelState
    driver_kind: type[Driver] | None
    driver: Any
    face: Array
    change_blend: ChangeBlendState
    shown: Array | None


class Puppet:
    """Binds a character once, and moves it frame after frame as its driver says.

    Args:
        character: what is moved.
        iterations: of the solver, a frame. Where there are several, the last one comes after the
            surface is shown: see `settle`. Targets of a skin need one less, since they are nearer.
        energy: what is kept as rigid as possible: see `ArapSolver`.
        tell: takes one line for the operator of the show.

    Attributes:
        character: what is moved.
        iterations: see above.
        bound_skeleton: the character's skeleton, bound to its surface.
        surface: the character's surface.
        driver: what moves it; None before the first one.
        proposal: a driver that is proposed in its place, and lights up instead; None without one.
        travel: how much of its way over the stage it goes.
        face: its morph targets, which follow the performer's blend shapes.
    """

    def __init__(
        self,
        character: Character,
        *,
        iterations: int = 2,
        energy: str = SPOKES,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self.character = character
        self.iterations = iterations
        proxy = proxy_of(character)
        self.bound_skeleton = skeleton = BoundSkeleton(character, proxy)
        self.surface = DeformableSurface(
            proxy, skeleton.handles, skeleton.stiff_segments, energy=energy
        )
        self.driver: Driver | None = None
        self.proposal: Driver | None = None
        self.layers: Layers | None = None
        self.travel = Travel()
        self.face = Face(character, tell)
        self._change_blend = ChangeBlend(skeleton)
        self._targets = skeleton.at_rest
        self._standing = [character.vertices.astype(np.float64) for _ in range(2)]
        self._root: Array = skeleton.tree.positions[skeleton.root]
        self._stance = Stance(0.0, self._root, np.zeros(3))

    def drive_with(self, driver: Driver) -> None:
        """Let another driver move the character from the next pose on; the surface stays."""
        self.driver = driver

    def ease(self) -> None:
        """Blend the next poses from what is shown now, whatever is about to change."""
        self._change_blend.begin(self._targets, self._standing[0])

    def change_at_once(self) -> None:
        """Show changes with the next pose, as in a pause, in which no time passes to ease them."""
        self._change_blend.reset()

    def rest(self) -> None:
        """Go back to the rest pose, unless the driver has other targets for the next pose."""
        self._targets = self.bound_skeleton.at_rest
        self.change_at_once()
        self.face.follow(None)

    def follow(self, pose: Pose) -> None:
        """Take over the targets that the driver has for the performer's pose, and the face."""
        self.face.follow(pose.blends)
        if self.driver is not None:
            targets = self.driver.targets(pose)
            if self.layers is not None:
                targets = self.layers.over(targets, pose.time)
            self._targets = self._change_blend.follow(targets, pose.time)
        self.travel.follow(pose.time)

    def deform(self) -> Motion:
        """Return the character as its targets say, on the stage."""
        return self._move(self._before_shown)

    def settle(self) -> None:
        """Take the iterations of this frame that are left, after the surface has been shown.

        A frame is seen one iteration earlier, and the next frame starts as near as if it had
        waited.
        """
        if isinstance(self._targets.shape, HandleTargets):
            self.surface.settle(self.iterations - self._before_shown)

    def attempt(self, pose: Pose) -> Motion:
        """Strike a pose as if none had been struck before."""
        self.forget()
        self.follow(pose)
        return self._move(FROM_REST)

    def forget(self) -> None:
        """Go on as if no pose had been struck; the targets stay."""
        self.surface.reset()
        self.travel.reset()
        self._change_blend.reset()
        if self.driver is not None:
            self.driver.reset()

    def snapshot(self) -> PuppetState:
        """Return what the next motion depends on, besides pose and elasticity."""
        driver = self.driver
        return PuppetState(
            self.surface.snapshot(),
            self._targets,
            self._stance,
            self.travel.snapshot(),
            None if driver is None else type(driver),
            None if driver is None else driver.snapshot(),
            self.face.weights.copy(),
            self._change_blend.snapshot(),
            self._standing[0].copy() if self._change_blend.has_shown else None,
        )

    def restore(self, state: PuppetState) -> None:
        """Go back to a snapshot of the same puppet.

        A driver of another class than that of the snapshot stays and begins anew.
        """
        self.surface.restore(state.surface)
        self.face.restore(state.face)
        self._targets, self._stance = state.targets, state.stance
        self.travel.restore(state.travel)
        self._change_blend.restore(state.change_blend)
        if state.shown is not None:
            self._standing[0][:] = state.shown
        if self.driver is None:
            return
        if type(self.driver) is state.driver_kind:
            self.driver.restore(state.driver)
        else:
            self.driver.reset()

    @property
    def root(self) -> Array:
        """(3,) [m] the root node at rest; the whole character turns about it."""
        return self._root

    @property
    def travelled(self) -> Array:
        """(2,) [m] along x and z, how far it is from where it would stand in place."""
        travelled: Array = self._stance.shift[::2]
        return travelled

    @property
    def shown(self) -> Array:
        """(N, 3) [m] the vertices as they were shown last; overwritten two motions later."""
        return self._standing[0]

    @property
    def places(self) -> Array:
        """(K, 3) [m] the nodes on the stage; at rest where the driver poses none."""
        nodes = self._targets.nodes
        return self._stance.place((nodes or self.bound_skeleton.rest_nodes).positions)

    @property
    def highlights(self) -> list[Highlight]:
        """The highlights of the driver that is proposed, or else of the one that moves it."""
        place, nodes, layers = self._stance.place, self._targets.nodes, self.layers
        driver = self.driver if self.proposal is None else self.proposal
        seeks = layers is not None and layers.seeks
        if driver is None or (layers is not None and not layers.shows_driver and not seeks):
            return []
        if nodes is not None and (self.proposal is not None or seeks):
            return [  # on the character as it is now, which something else moves
                Highlight(place(nodes.positions[list(part.target)]), part.source[1:])
                for part in driver.parts
            ]
        return [replace(each, points=place(each.points)) for each in driver.highlights]

    def stood(self, skinned: SkinnedTargets, placement: Placement) -> Array:
        """Return where a skin puts the character (N, 3) [m] on the stage; nothing else changes.

        The surface is not made even, and the face is at rest.
        """
        standing = np.empty_like(self._standing[0])
        vertices = self.surface.cover(skinned.positions)
        put_on_stage(vertices, self.travel.of(placement), self._root, standing)
        return standing

    @property
    def _before_shown(self) -> int:
        return max(self.iterations - 1, 1)

    def _move(self, iterations: int) -> Motion:
        """Deform the surface as the targets say, and put the character on the stage."""
        targets = self._targets
        vertices = self._vertices(targets.shape, iterations)
        self._standing.reverse()
        standing = self._standing[0]
        placement = self.travel.of(targets.placement)
        self._stance = put_on_stage(vertices, placement, self._root, standing)
        self.face.move(standing)
        self._change_blend.ease(standing)
        nodes = None if targets.nodes is None else self._stance.place_nodes(targets.nodes)
        return Motion(standing, nodes, self.face.weights if len(self.face.weights) else None)

    def _vertices(self, shape: HandleTargets | SkinnedTargets | Array, iterations: int) -> Array:
        """The character's vertices (N, 3) [m] before the placement."""
        if isinstance(shape, SkinnedTargets):  # no more steps after a jump than in a show
            return self.surface.cover(self.surface.deform(shape, self._before_shown))
        if isinstance(shape, HandleTargets):
            return self.surface.cover(self.surface.deform(shape, iterations))
        if shape.shape != self.character.vertices.shape:
            raise ValueError(
                f"expected a surface of shape {self.character.vertices.shape}, got {shape.shape}"
            )
        return np.ascontiguousarray(shape, dtype=np.float64)
