"""A dense character gets a proxy, made of its own vertices, that its surface follows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from replay.formats import read_recording
from runtime.benchmarks.dense import measure
from runtime.characters.builtin import builtin_character
from runtime.characters.character import Character
from runtime.characters.character_file import read_character
from runtime.characters.proxy import DENSE, PROXY, proxy_of


@pytest.fixture(scope="module")
def mannequin() -> Character:
    return builtin_character("mannequin")


def test_no_built_in_character_needs_one(mannequin: Character):
    assert len(mannequin.vertices) <= DENSE
    proxy = proxy_of(mannequin)
    moved = mannequin.vertices + 1.0
    assert proxy.surface is None
    assert proxy.follow(moved) is moved
    assert (proxy.kept == np.arange(len(mannequin.vertices))).all()


def test_a_dense_one_follows_its_own_vertices(mannequin: Character):
    proxy = proxy_of(mannequin, dense=5_000, count=2_000)
    assert len(proxy.vertices) == 2_000
    assert (proxy.vertices == mannequin.vertices[proxy.kept]).all()
    raised = np.array([0.0, 1.0, 0.0])
    out = proxy.follow(proxy.vertices + raised)
    np.testing.assert_allclose(out, mannequin.vertices + raised, atol=1e-8)
    assert proxy.follow(proxy.vertices) is out  # nothing new for each frame
    assert not proxy.notes


def test_a_soup_of_triangles_is_deformed_in_full_and_says_so(mannequin: Character):
    count = 3_000
    soup = replace(
        mannequin,
        vertices=np.random.default_rng(0).random((count, 3)),
        faces=np.arange(count).reshape(-1, 3),
    )
    proxy = proxy_of(soup, dense=1_000, count=500)
    assert proxy.surface is None
    assert "deformed in full" in proxy.notes[0]


def test_an_armadillo_is_deformed_as_by_the_full_solve(shared: Path):
    armadillo = read_character(shared / "mesh" / "cgal_armadillo.off")
    assert len(armadillo.vertices) > DENSE
    jumping = read_recording(shared / "bvh" / "cmu1_jumping_jacks_animdraw.bvh")
    figures = measure(armadillo, jumping, settle=False, frames=20)
    assert figures["proxy_vertices"] == PROXY
    error = figures["error"]
    assert 0.0 < error["rms"] < 0.3  # percent of the diagonal
    assert error["p99"] < 1.0
    assert error["stretch"] < error["stretch_full"] + 0.05
    assert error["normals_mean"] < 4.0
