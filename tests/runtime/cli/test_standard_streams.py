"""Standard streams that are closed or full, and what is never written to a terminal."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from devices.printable import printable
from tests.runtime.cli.program import BUNRAKU, ENVIRONMENT, Run

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux's /dev/full")


def closed(*descriptors: int) -> subprocess.CompletedProcess[bytes]:
    """`bunraku record` and then `bunraku info` of nothing, without some standard streams."""
    shell = " ".join(f"{descriptor}>&-" for descriptor in descriptors)
    return subprocess.run(
        ["sh", "-c", f'exec "$@" {shell}', "sh", *BUNRAKU, "info", "nothere.mcap"],
        env=ENVIRONMENT,
        capture_output=True,
        check=False,
    )


@pytest.mark.parametrize("descriptors", [(2,), (0, 1, 2)])
def test_a_closed_stream_changes_no_exit_code(descriptors: tuple[int, ...]) -> None:
    done = closed(*descriptors)
    assert done.returncode == 2
    assert done.stdout == b""


@pytest.mark.parametrize(
    ("command", "code"), [(("info", "nothere.mcap"), 2), (("info", "paper"), 2)]
)
def test_a_full_disk_behind_both_streams_is_no_traceback(
    command: tuple[str, ...], code: int
) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*BUNRAKU, *command], env=ENVIRONMENT, stdout=full, stderr=full, check=False
        )
    assert done.returncode == code


def test_no_file_takes_the_place_of_a_closed_stream(tmp_path: Path) -> None:
    """Else a library's warning, which goes to descriptor 2, would end up in a recording."""
    told = (
        "import os, sys\n"
        "from runtime.show.messages import open_standard_streams\n"
        "os.close(2)\n"
        "open_standard_streams()\n"
        f"file = open({str(tmp_path / 'a')!r}, 'wb')\n"
        "os.write(2, b'a warning')\n"
        "sys.exit(file.fileno() <= 2)\n"
    )
    done = subprocess.run([BUNRAKU[0], "-c", told], env=ENVIRONMENT, check=False)
    assert done.returncode == 0
    assert (tmp_path / "a").read_bytes() == b""


NAMES = ["\x1b]0;owned\x07", "a\x1b[2Jb", "\u202egpj.exe", "a\nb\r\tc", "\x9b31m"]


@pytest.mark.parametrize("name", NAMES)
def test_what_a_terminal_would_obey_is_not_shown(name: str, bunraku: Run, tmp_path: Path) -> None:
    assert printable(name).isprintable()
    path = tmp_path / "names.csv"
    path.write_text(
        '# bunraku.skeleton {"names": [%s, "hand"], "parents": [-1, 0], '
        '"rest_positions": [[0, 0, 0], [1, 0, 0]]}\nheader\n0,0,0,0,0,0,1,1,0,0,1\n'.replace(
            "%s", json.dumps(name)
        )
    )
    out = tmp_path / "again.bvh"
    for arguments in (
        ("info", path),
        ("convert", path, out),
        ("info", out),
        ("info", name),
        (name,),
        ("record", "--device", f"sim://{name}", "a.mcap"),
        ("replay", path, "--character", "paper", "--mapping", name),
    ):
        done = bunraku(*arguments)
        assert done.stdout + done.stderr
        shown = (done.stdout + done.stderr).replace("\n", "")
        assert shown.isprintable(), ascii(shown)


def test_graphics_drivers_do_not_write_to_the_terminal() -> None:
    told = (
        "from devices.errors import InputError\n"
        "from runtime.render.context import headless_context\n"
        "try: headless_context()\n"
        "except InputError: pass\n"
    )
    environment = {**ENVIRONMENT, "MESA_LOADER_DRIVER_OVERRIDE": "none-of-this-name"}
    for name in ("EGL_LOG_LEVEL", "MESA_LOG"):
        environment.pop(name, None)
    done = subprocess.run(
        [BUNRAKU[0], "-c", told], env=environment, capture_output=True, check=False
    )
    assert (done.stdout, done.stderr) == (b"", b"")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a POSIX pipe")
@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "pipe"),
        ("record", "--device", "sim://show", "--seconds", "1", "pipe"),
        ("replay", "wave.mcap", "--character", "paper", "--record", "pipe"),
        ("convert", "pipe", "a.bvh"),
    ],
)
def test_a_pipe_is_no_recording(
    arguments: tuple[str, ...], bunraku: Run, in_folder: Path, recording: Path
) -> None:
    os.mkfifo(in_folder / "pipe")  # whoever opens it waits for ever
    (in_folder / "wave.mcap").symlink_to(recording)
    done = bunraku(*arguments)
    assert done.returncode == 2
    assert "pipe is a pipe or a device, not a file" in done.stderr
