"""Files that are written in one piece appear whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from devices.errors import InputError
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file, writing


def test_a_file_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "show.json"
    target.write_text("old")

    def interrupted() -> None:
        with whole_file(target) as path:
            path.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "old"
    with whole_file(target) as path:
        path.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert [entry.name for entry in tmp_path.iterdir()] == ["show.json"]


def test_a_link_stays_a_link_and_its_file_is_written(tmp_path: Path) -> None:
    real = tmp_path / "real.json"
    real.write_text("old")
    link = tmp_path / "link.json"
    link.symlink_to(real)
    with whole_file(link) as path:
        path.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a POSIX pipe")
def test_what_is_no_plain_file_is_written_and_not_replaced(tmp_path: Path) -> None:
    # A pipe of its own, never a real device: a failing implementation run as root replaces it.
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDWR)  # both ways, so that neither side waits for the other
    try:
        with whole_file(pipe) as path:
            path.write_text("through")
        assert pipe.is_fifo()
        os.set_blocking(reader, False)
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)


def test_a_failing_disk_is_one_line_that_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught, writing(tmp_path / "x.pc2"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert "x.pc2" in str(caught.value)
    assert os.strerror(errno.ENOSPC) in str(caught.value)
    assert "free some space" in str(caught.value)
    with pytest.raises(InputError) as caught, writing(tmp_path / "x.pc2"):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    assert "space" not in str(caught.value), "that would not help"
    assert "\n" not in str(caught.value)


def test_places_that_cannot_be_written_are_found_before_the_show(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a folder"):
        check_writable(tmp_path)
    with pytest.raises(InputError, match="there is no folder"):
        check_writable(tmp_path / "missing" / "x.pc2")
    with pytest.raises(InputError, match="there is no folder"):
        check_writable(tmp_path / "file" / "x.pc2")
    check_writable(tmp_path / "x.pc2")
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_read_only_folder_is_found_before_the_show(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="Permission denied"):
        check_writable(tmp_path / "x.pc2")


def test_an_unknown_suffix_lists_the_known_ones() -> None:
    assert check_suffix(Path("a.USDA"), (".usda", ".glb")) == ".usda"
    with pytest.raises(InputError, match=r"\.usda, \.glb"):
        check_suffix(Path("a.fbx"), (".usda", ".glb"))
