"""Pictures on their way to other programs, by stand-ins for their libraries in another process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
RED, BLUE = (250, 20, 10, 255), (10, 40, 240, 255)

PYVIRTUALCAM = """
    import enum, json, os
    class PixelFormat(enum.Enum):
        RGB = "raw "
        RGBA = "ABGR"
    def tell(*what):
        with open(os.environ["TOLD"], "a") as file:
            file.write(json.dumps(what) + "\\n")
    class Camera:
        def __init__(self, width, height, fps, *, fmt, device=None):
            if device == "none":
                raise RuntimeError("'v4l2loopback' backend: no device\\nanother: none")
            tell("open", width, height, fps, fmt.name, device)
        def send(self, frame):
            assert frame.flags.c_contiguous
            tell("send", frame.shape, str(frame.dtype), frame[0, 0].tolist(), frame[-1, 0].tolist(),
                 frame[0, -1].tolist())
        def close(self):
            tell("close")
"""
CYNDILIB = """
    import enum, json, os
    def tell(*what):
        with open(os.environ["TOLD"], "a") as file:
            file.write(json.dumps(what) + "\\n")
    class FourCC(enum.Enum):
        RGBA = 1
        RGBX = 2
    class VideoSendFrame:
        def set_resolution(self, width, height): self.size = width, height
        def set_frame_rate(self, rate): self.rate = float(rate)
        def set_fourcc(self, fourcc): self.fourcc = fourcc.name
    class Sender:
        def __init__(self, name, *, clock_video, clock_audio):
            self.name, self.clocked = name, clock_video
        def set_video_frame(self, frame): self.frame = frame
        def open(self):
            if self.name == "none":
                raise MemoryError
            tell("open", self.name, self.clocked, *self.frame.size, self.frame.rate,
                 self.frame.fourcc)
        def write_video_async(self, data):
            width, height = self.frame.size
            assert data.ndim == 1 and data.flags.writeable and data.size == width * height * 4
            rows = data.reshape(height, width, 4)
            tell("send", rows.shape, str(data.dtype), rows[0, 0].tolist(), rows[-1, 0].tolist(),
                 rows[0, -1].tolist())
        def close(self): tell("close")
"""
SPOUT = """
    import json, os
    import numpy as np
    def tell(*what):
        with open(os.environ["TOLD"], "a") as file:
            file.write(json.dumps(what) + "\\n")
    class SpoutSender:
        def setSenderName(self, name): tell("open", name)
        def sendImage(self, data, width, height, form, invert, fbo):
            rows = np.frombuffer(data, np.uint8).reshape(height, width, 4)
            tell("send", rows.shape, form, invert, fbo, rows[0, 0].tolist(), rows[-1, 0].tolist(),
                 rows[0, -1].tolist())
            return os.environ.get("BROKEN") is None
        def setFrameSync(self, name): tell("sync", name)
        def releaseSender(self): tell("close")
"""
SYPHON = """
    import json, os
    def tell(*what):
        with open(os.environ["TOLD"], "a") as file:
            file.write(json.dumps(what) + "\\n")
    class SyphonMetalServer:
        def __init__(self, name):
            self.device = "metal"
            tell("open", name)
        def publish_frame_texture(self, texture, is_flipped=False):
            tell("publish", texture, is_flipped)
        def stop(self): tell("close")
"""
SYPHON_RAW = """
    import numpy as np
    from syphon import tell
    def create_mtl_texture(device, width, height):
        return [device, width, height]
    def copy_bytes_to_mtl_texture(data, texture):
        _, width, height = texture
        rows = np.frombuffer(data, np.uint8).reshape(height, width, 4)
        tell("copy", rows[0, 0].tolist(), rows[-1, 0].tolist(), rows[0, -1].tolist())
"""
STAND_INS = {
    "pyvirtualcam.py": PYVIRTUALCAM,
    "cyndilib/__init__.py": CYNDILIB,
    "cyndilib/wrapper.py": "",
    "SpoutGL.py": SPOUT,
    "syphon/__init__.py": SYPHON,
    "syphon/utils/__init__.py": "",
    "syphon/utils/raw.py": SYPHON_RAW,
}


@pytest.fixture
def libraries(tmp_path: Path) -> dict[str, str]:
    """An environment in which Python finds the stand-ins."""
    for name, code in STAND_INS.items():
        path = tmp_path / "libraries" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(textwrap.dedent(code), encoding="utf-8")
    found = os.pathsep.join([str(tmp_path / "libraries"), str(ROOT)])
    return {**os.environ, "PYTHONPATH": found, "TOLD": str(tmp_path / "told")}


def run(code: str, libraries: dict[str, str]) -> list[list[object]]:
    """What the libraries were asked for by `code`, which finds `picture()` here."""
    head = "from tests.runtime.output.live.test_broadcast import *\n"
    done = subprocess.run(
        [sys.executable, "-c", head + textwrap.dedent(code)],
        env=libraries,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    told = Path(libraries["TOLD"])
    return [json.loads(line) for line in told.read_text().splitlines()] if told.exists() else []


def test_a_virtual_camera_gets_rgb_on_black_top_row_first(libraries: dict[str, str]) -> None:
    told = run(
        """
        from runtime.output.live.virtual_camera import VirtualCamera
        camera = VirtualCamera("", (6, 4), 30.0)
        with Broadcast("it", camera, (6, 4), 30.0, tell=print) as output:
            output.write(performed(0, picture()))
            output.write(performed(1, picture()[::-1]))
        try:
            VirtualCamera("none", (6, 4), 30.0)
        except InputError as error:
            assert "called 'none'" in str(error) and "v4l2loopback" in str(error)
        else:
            raise AssertionError
        """,
        libraries,
    )
    red, blue, grey = list(RED[:3]), list(BLUE[:3]), [128, 128, 128]
    assert told == [
        ["open", 6, 4, 30.0, "RGB", None],
        ["send", [4, 6, 3], "uint8", red, blue, grey],
        ["send", [4, 6, 3], "uint8", blue, red, blue],
        ["close"],
    ]


@pytest.mark.parametrize("alpha", [True, False])
def test_ndi_gets_rgba_with_straight_alpha_and_never_waits(
    libraries: dict[str, str], alpha: bool
) -> None:
    told = run(
        f"""
        from runtime.output.live.ndi import NdiSender
        ndi = NdiSender("stage", (6, 4), 59.94, alpha={alpha})
        with Broadcast("it", ndi, (6, 4), 30.0, tell=print) as output:
            output.write(performed(0, picture()))
        try:
            NdiSender("none", (6, 4), 30.0, alpha={alpha})
        except InputError as error:
            assert "NDI does not start here" in str(error)
        else:
            raise AssertionError
        """,
        libraries,
    )
    (opened, sent, closed) = told
    assert opened[:5] == ["open", "stage", False, 6, 4]
    assert opened[5] == pytest.approx(59.94, abs=0.001)
    assert opened[6] == ("RGBA" if alpha else "RGBX")
    assert sent == ["send", [4, 6, 4], "uint8", list(RED), list(BLUE), [255, 255, 255, 128]]
    assert closed == ["close"]


def test_spout_gets_rgba_with_straight_alpha_top_row_first(libraries: dict[str, str]) -> None:
    told = run(
        """
        from runtime.output.live.shared_texture import open_shared_texture
        sender = open_shared_texture("stage", (6, 4), platform="win32")
        with Broadcast("it", sender, (6, 4), 30.0, tell=print) as output:
            output.write(performed(0, picture()[:, ::-1][:, ::-1]))
        """,
        libraries,
    )
    white = [255, 255, 255, 128]
    assert told == [
        ["open", "stage"],
        ["send", [4, 6, 4], 0x1908, False, 0, list(RED), list(BLUE), white],
        ["sync", "stage"],
        ["close"],
    ]


def test_spout_on_a_driver_that_shares_nothing_is_told(libraries: dict[str, str]) -> None:
    told = run(
        """
        from runtime.output.live.shared_texture import open_shared_texture
        lines = []
        sender = open_shared_texture("stage", (6, 4), platform="win32")
        output = Broadcast("the shared picture", sender, (6, 4), 30.0, tell=lines.append)
        output.show(picture())
        output.show(picture())
        assert len(lines) == 1 and "shares no textures" in lines[0]
        """,
        libraries | {"BROKEN": "1"},
    )
    assert [what for what, *_ in told] == ["open", "send", "close"]


def test_syphon_gets_premultiplied_rgba_lowest_row_first(libraries: dict[str, str]) -> None:
    told = run(
        """
        from runtime.output.live.shared_texture import open_shared_texture
        sender = open_shared_texture("stage", (6, 4), platform="darwin")
        with Broadcast("it", sender, (6, 4), 30.0, tell=print) as output:
            output.write(performed(0, picture()))
        """,
        libraries,
    )
    assert told == [
        ["open", "stage"],
        ["copy", list(RED), list(BLUE), [128, 128, 128, 128]],
        ["publish", ["metal", 6, 4], True],  # turned over on its way
        ["close"],
    ]


def test_a_whole_show_reaches_a_camera_and_ndi(libraries: dict[str, str], tmp_path: Path) -> None:
    told = run(
        f"""
        from runtime.cli import main
        take = {str(tmp_path / "wave.mcap")!r}
        assert main(["record", "--device", "sim://wave", "--seconds", "0.2", take]) == 0
        show = ["replay", take, "--character", "paper", "--headless", "--fast"]
        show += ["--size", "64x48", "--background", "chroma", "--fps", "1000"]
        assert main([*show, "--virtual-camera", "/dev/video7", "--ndi", "stage"]) == 0
        """,
        libraries,
    )
    opened = [what for what in told if what[0] == "open"]
    assert opened == [
        ["open", 64, 48, 1000.0, "RGB", "/dev/video7"],
        ["open", "stage", False, 64, 48, 1000.0, "RGBX"],
    ]
    sent = [what for what in told if what[0] == "send"]
    assert len(sent) >= 10
    for _, shape, kind, *corners in sent:
        assert shape in ([48, 64, 3], [48, 64, 4])
        assert kind == "uint8"
        assert all(corner[:3] == [0, 255, 0] for corner in corners)
    assert [what for what in told if what[0] == "close"] == [["close"]] * 2
