"""Pictures that go to other programs, by stand-ins for their libraries in an interpreter apart."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.errors import InputError
from runtime.cli import main
from runtime.output.live.broadcast import Broadcast
from runtime.output.live.shared_texture import import_shared_texture
from runtime.output.output import Output, PerformedFrame, Screen
from runtime.output.pictures import fitted, on_black, premultiplied

ROOT = Path(__file__).resolve().parents[4]
RED, BLUE, CLEAR = (250, 20, 10, 255), (10, 40, 240, 255), (0, 0, 0, 0)


def picture(size: tuple[int, int] = (6, 4)) -> np.ndarray:
    """Red above, blue below, a half-transparent white pixel at the upper right."""
    width, height = size
    made = np.empty((height, width, 4), np.uint8)
    made[: height // 2], made[height // 2 :] = RED, BLUE
    made[0, -1] = 255, 255, 255, 128
    return made


def performed(index: int, shown: np.ndarray | None) -> PerformedFrame:
    empty = np.zeros((0, 3))
    return PerformedFrame(index, index / 30.0, empty, None, shown)


class Wire:
    """A sender that keeps what it is given, and breaks when it is told to."""

    def __init__(self) -> None:
        self.pictures: list[np.ndarray] = []
        self.breaks = self.closed = False

    def send(self, shown: np.ndarray) -> None:
        if self.breaks:
            raise RuntimeError("unplugged")
        self.pictures.append(shown.copy())

    def close(self) -> None:
        self.closed = True


# Pictures


@given(st.integers(0, 255), st.integers(0, 255))
def test_on_black_is_the_rounded_product(colour: int, alpha: int) -> None:
    one = np.array([[[colour, 255, 0, alpha]]], np.uint8)
    expected = [round(colour * alpha / 255), alpha, 0]
    assert on_black(one)[0, 0].tolist() == expected
    assert premultiplied(one)[0, 0].tolist() == [*expected, alpha]


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 40), st.integers(1, 40))
def test_what_fits_is_whole_in_the_middle_with_the_background_beside_it(
    width: int, height: int, to_width: int, to_height: int
) -> None:
    shown = np.full((height, width, 4), CLEAR, np.uint8)
    fits = fitted(shown, (to_width, to_height))
    assert fits.shape == (to_height, to_width, 4)
    assert fits.flags.writeable
    assert not fits.any()
    shown[:] = (0, 255, 0, 255)
    assert (fitted(shown, (to_width, to_height)) == (0, 255, 0, 255)).all()


def test_a_wide_picture_keeps_its_shape_in_a_tall_frame() -> None:
    shown = np.full((10, 20, 4), RED, np.uint8)
    shown[:, :2] = shown[:, -2:] = BLUE  # a frame, whose colour goes on
    shown[:2] = shown[-2:] = BLUE
    fits = fitted(shown, (20, 40))
    assert (fits[:15] == BLUE).all()
    assert (fits[25:] == BLUE).all()
    np.testing.assert_array_equal(fits[15:25], shown)


# What every broadcast does


def test_every_picture_is_sent_in_order_at_one_size_and_more_while_nobody_is_seen() -> None:
    wire, told = Wire(), []
    with Broadcast("it", wire, (6, 4), 30.0, tell=told.append) as output:
        kept: Output = output
        assert isinstance(output, Screen)
        kept.write(performed(0, picture()))
        kept.write(performed(1, None))  # not every frame has one
        kept.write(performed(2, 255 - picture((12, 8))))
        output.show(picture())
    output.close()
    assert wire.closed
    assert [one.shape for one in wire.pictures] == [(4, 6, 4)] * 3
    np.testing.assert_array_equal(wire.pictures[0], picture())
    np.testing.assert_array_equal(wire.pictures[2], picture())
    assert told == []


def test_a_library_that_fails_is_told_once_and_the_show_goes_on() -> None:
    wire, told = Wire(), []
    output = Broadcast("the camera", wire, (6, 4), 30.0, tell=told.append)
    wire.breaks = True
    for index in range(5):
        output.write(performed(index, picture()))
    assert told == ["the camera has stopped (unplugged); the show goes on without it"]
    assert wire.closed
    output.close()


# What is missing


@pytest.mark.parametrize(
    ("option", "module", "extra"),
    [("--virtual-camera", "pyvirtualcam", "camera"), ("--ndi", "cyndilib", "ndi")],
)
def test_a_missing_library_is_one_line_that_names_the_extra(
    option: str,
    module: str,
    extra: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert main(["demo", "--headless", "--fast", option, "name"]) == 2
    line = capsys.readouterr().err
    assert line.endswith(f"{option} needs the extra: pip install 'bunraku[{extra}]'\n")
    assert line.count("\n") == 1


@pytest.mark.parametrize(("platform", "module"), [("win32", "SpoutGL"), ("darwin", "syphon")])
def test_spout_names_its_extra_where_it_could_be_and_says_so_where_it_cannot(
    platform: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=r"--spout needs the extra: pip install 'bunraku\[spout]'"):
        import_shared_texture(platform)
    with pytest.raises(InputError, match="neither here; use --ndi or --virtual-camera"):
        import_shared_texture("linux")


# The libraries themselves, stood in for: each writes down what it is asked for

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
