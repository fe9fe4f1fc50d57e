"""The paper's figures: what they claim holds, and the command draws them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devices.errors import InputError
from runtime.cli import main
from runtime.figures import convergence
from runtime.figures.bird import bird, tail_volume
from runtime.figures.plain import PlainSolver, volume, volume_gradient
from runtime.figures.poses import Press, perform
from runtime.figures.revolved import revolved
from runtime.render.context import headless_context, release_headless
from solvers.arap import ArapSolver
from solvers.squash_stretch import SquashStretchSolver


@pytest.fixture(scope="module")
def curves() -> Sequence[convergence.Curves]:
    return convergence.measure()


@pytest.mark.parametrize("energy", ["ARAP", "squash and stretch"])
def test_ours_needs_no_more_iterations_than_the_plain_equations(
    curves: Sequence[convergence.Curves], energy: str
):
    never = convergence.FRAMES + 1
    for curve in curves:
        for share in convergence.SHARES:
            ours = curve.iterations_to(f"{energy}, ours", share)
            plain = curve.iterations_to(f"{energy}, plain", share)
            assert (never if ours is None else ours) <= (never if plain is None else plain)
    bend = curves[0]
    assert bend.iterations_to(f"{energy}, ours", 0.05) < bend.iterations_to(
        f"{energy}, plain", 0.05
    )


def test_energies_fall_and_the_table_tells_when(curves: Sequence[convergence.Curves]):
    for curve in curves:
        for method, shares in curve.shares.items():
            assert (np.diff(shares) < 1e-9).all(), (curve.name, method)
            first = curve.iterations_to(method, 0.10)
            assert first is None or (shares[first] <= 0.10 and (shares[:first] > 0.10).all())
    lines = convergence.table(curves)
    assert lines[0].split()[-4:] == ["30%", "20%", "10%", "5%"]
    assert len(lines) == 1 + 4 * len(curves)


def test_the_curves_are_drawn_in_their_colours(curves: Sequence[convergence.Curves]):
    picture = convergence.draw(curves, (640, 400))
    assert picture.size == (640, 400)
    colours = {colour for _, colour in picture.getcolors(1_000_000)}
    for colour in convergence._COLOURS.values():
        assert colour in colours


def test_the_tail_stays_while_the_whole_volume_would_fill_it():
    character = bird()
    press = Press.on(character)
    rest = volume(character.vertices, character.faces)
    solver = SquashStretchSolver(
        character.vertices, character.faces, press.handles, groups=press.groups
    )
    ours = perform(solver, press, 0.7, 0.0)
    plain = PlainSolver(character.vertices, character.faces, press.handles)
    whole = plain.cold_start(press.targets(0.7, 0.0))
    for _ in range(25):
        whole = plain.whole_volume_step(whole)
    for answer in (ours, whole):
        assert volume(answer, character.faces) == pytest.approx(rest, rel=1e-3)
    tail = tail_volume(character.vertices, character)
    assert tail_volume(ours, character) == pytest.approx(tail, rel=0.01)
    assert tail_volume(whole, character) > 1.05 * tail


def test_the_plain_equations_come_to_our_answer():
    vertices, faces = revolved(np.linspace(0.0, 2.0, 12), np.full(12, 0.4), 9)
    handles = np.flatnonzero((vertices[:, 0] < 0.1) | (vertices[:, 0] > 1.9))
    targets = vertices[handles] + (vertices[handles, :1] > 1.0) * np.array([0.0, 0.4, 0.2])
    plain, ours = PlainSolver(vertices, faces, handles), ArapSolver(vertices, faces, handles)
    x = plain.cold_start(targets)
    for _ in range(400):
        x = plain.rigid_step(x)
        answer = ours.solve(targets, 1)
    np.testing.assert_allclose(answer, x, atol=1e-5)
    assert plain.rigid_energy(x) == pytest.approx(ours.energy, rel=1e-6)


def test_the_gradient_of_the_volume_is_its_difference():
    vertices, faces = revolved(np.linspace(0.0, 1.0, 5), np.full(5, 0.3), 6)
    rng = np.random.default_rng(1)
    x, step = vertices + rng.normal(0, 0.02, vertices.shape), rng.normal(0, 1e-6, vertices.shape)
    change = volume(x + step, faces) - volume(x - step, faces)
    assert change == pytest.approx(2 * (volume_gradient(x, faces) * step).sum(), rel=1e-6)
    assert volume(vertices, faces) > 0.0  # faces look out


@pytest.fixture
def barrel(tmp_path: Path) -> Path:
    """A file of a round barrel that stands upright, and a loose speck beside it."""
    vertices, faces = revolved(np.linspace(0.0, 1.0, 10), np.full(10, 0.3), 10)
    vertices = vertices[:, [1, 0, 2]]
    speck = np.array([[0.9, 0.4, 0.0], [1.0, 0.4, 0.0], [0.9, 0.5, 0.0]])
    faces = np.concatenate([faces[:, ::-1], len(vertices) + np.array([[0, 1, 2]])])
    path = tmp_path / "barrel.obj"
    lines = [f"v {x} {y} {z}" for x, y, z in np.vstack([vertices, speck])]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_the_command_draws_three_pictures(
    tmp_path: Path, barrel: Path, capsys: pytest.CaptureFixture[str]
):
    try:
        release_headless(headless_context())
    except InputError as error:
        pytest.skip(str(error))
    folder = tmp_path / "new" / "pictures"
    arguments = ["figures", str(folder), "--character", str(barrel), "--size", "320x90"]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "squashed, ours: volume 100" in said
    assert "iterations to" in said
    sizes = {"figure-5.png": (320, 90), "figure-6.png": (320, 180), "figure-7.png": (320, 192)}
    for name, size in sizes.items():
        with Image.open(folder / name) as picture:
            assert picture.size == size
            assert len(picture.convert("RGB").getcolors(1_000_000)) > 50


def test_a_character_with_nothing_between_foot_and_top_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    path = tmp_path / "tetrahedron.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    assert main(["figures", str(tmp_path), "--character", str(path), "--size", "64x48"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "nothing is left between its foot and its top" in error


def test_the_window_is_drawn_for_the_documents(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figures", str(tmp_path), "--of", "window", "--size", "320x180"]) == 0
    names = ("matching", "performing", "session", "hands-free", "mapped")
    pictures = [np.asarray(Image.open(tmp_path / f"{name}.jpg").convert("RGB")) for name in names]
    assert all(picture.shape == (180, 320, 3) for picture in pictures)
    for one, another in itertools.pairwise(pictures):
        assert (one != another).any()
    assert len(capsys.readouterr().out.splitlines()) == len(names)
