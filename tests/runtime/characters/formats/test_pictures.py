"""Untrusted pictures beside a mesh: one note at most, and bounded in sum."""

from __future__ import annotations

import subprocess
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from runtime.benchmarks.fuzzing.file_samples import TEXTURED, pictures
from runtime.characters.formats.mesh_file import read_mesh_file
from tests.runtime.cli.program import ENVIRONMENT

MUTATED = """
import random, sys
from pathlib import Path
from runtime.benchmarks.fuzzing.damage import damaged
from runtime.benchmarks.fuzzing.file_samples import TEXTURED, pictures
from runtime.benchmarks.fuzzing.watch import Watch
from runtime.characters.formats.mesh_file import read_mesh_file
folder, samples, notes = Path(sys.argv[1]), list(pictures().values()), []
(folder / "m.obj").write_text(TEXTURED)
suffixes = ("png", "jpg", "webp", "eps", "tif", "icns", "gif", "ps")
def read():
    notes.append(read_mesh_file(folder / "m.obj").notes)
chance, watch = random.Random(5), Watch()
with watch.quiet():
    for suffix in suffixes:  # what is imported at first use
        (folder / "m.mtl").write_text(f"newmtl a\\nmap_Kd t.{suffix}\\n")
        for sample in samples:
            (folder / f"t.{suffix}").write_bytes(sample)
            read()
    faults = []
    notes.clear()
    for number in range(500):
        suffix = chance.choice(suffixes)
        (folder / "m.mtl").write_text(f"newmtl a\\nmap_Kd t.{suffix}\\n")
        (folder / f"t.{suffix}").write_bytes(damaged(chance, samples))
        faults.append(watch.fault(read))
print(len(notes), max(map(len, notes)), sum(map(len, notes)), *filter(None, faults))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="alarms are POSIX")
def test_500_damaged_pictures_start_nothing_and_write_nothing(tmp_path: Path) -> None:
    """The watch sees processes, written files, warnings and output by an audit hook."""
    done = subprocess.run(
        [sys.executable, "-c", MUTATED, str(tmp_path)],
        env=ENVIRONMENT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    read, most, noted = map(int, done.stdout.split(None, 3)[:3])
    assert (read, most, done.stderr) == (500, 1, "")
    assert 250 < noted < 500  # some damage leaves a picture that can be shown
    assert len(done.stdout.split()) == 3, done.stdout


@pytest.mark.parametrize("kind", pictures())
def test_only_three_kinds_of_picture_are_read(kind: str, tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(TEXTURED)
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n")
    (tmp_path / "t.png").write_bytes(pictures()[kind])
    mesh = read_mesh_file(tmp_path / "m.obj")
    shown = any(material.texture is not None for material in mesh.materials)
    assert shown == (kind in ("png", "jpeg", "webp"))
    assert len(mesh.notes) == (0 if shown else 1)


def test_all_textures_of_an_obj_share_one_budget(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("runtime.characters.formats.mtl.MOST_PIXELS", 250)
    for library in "ab":
        for number in range(2):
            Image.fromarray(np.zeros((10, 10, 3), np.uint8)).save(
                tmp_path / f"{library}{number}.png"
            )
        lines = [f"newmtl {library}{k}\nmap_Kd {library}{k}.png\n" for k in range(2)]
        lines.append(f"newmtl {library}again\nmap_Kd {library}0.png\n")
        (tmp_path / f"{library}.mtl").write_text("".join(lines))
    uses = "".join(f"usemtl {name}\nf 1 2 3\n" for name in ("a0", "a1", "aagain", "b0", "b1"))
    text = TEXTURED.replace("m.mtl", "a.mtl b.mtl").split("usemtl")[0] + uses
    (tmp_path / "m.obj").write_text(text)
    mesh = read_mesh_file(tmp_path / "m.obj")
    assert mesh.face_material is not None
    shown = [mesh.materials[slot].texture is not None for slot in mesh.face_material]
    assert shown == [True, True, True, False, False]
    assert mesh.notes == (
        "texture 'b0.png' is too large: left out",
        "texture 'b1.png' is too large: left out",
    )


def test_threads_that_read_leave_the_warnings_as_they_were(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(TEXTURED)
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n")
    (tmp_path / "t.png").write_bytes(pictures()["png"])
    before = list(warnings.filters)

    def read() -> None:
        for _ in range(50):
            read_mesh_file(tmp_path / "m.obj")

    threads = [threading.Thread(target=read) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert warnings.filters == before
