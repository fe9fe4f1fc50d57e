"""Output of a video file with variable frame rate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.output.files.video_file import VideoFile
from runtime.output.files.video_sound import VideoSound
from runtime.output.files.whole_file import check_suffix, check_writable, writing
from runtime.output.output import PerformedFrame
from runtime.output.pictures import premultiplied

_TICKS = 90_000  # a second, MPEG's own clock
_SHORTEST = _TICKS // 1000  # Matroska counts milliseconds: no two frames may share one
_BT709 = 1  # primaries, transfer and matrix alike; ITU-T H.273, tables 2 to 4
_LIMITED_RANGE = 1  # luma 16 to 235, as players expect
_H264 = {
    # Mode 3 spends more bits on dark areas, so dark gradients of the stage show no bands.
    "libx264": {"crf": "18", "preset": "veryfast", "aq-mode": "3"},
    "libopenh264": {"b": "8M"},
    "mpeg4": {"qscale": "3", "flags": "+qscale"},
}
_CONTAINERS = {
    ".mp4": "mp4",
    ".m4v": "mp4",
    ".mov": "mov",
    ".mkv": "matroska",
    ".webm": "webm",
}
_ENCODERS: dict[str, dict[str, dict[str, str]]] = {
    ".mp4": _H264,
    ".m4v": _H264,
    ".mov": _H264,
    ".mkv": _H264,
    ".webm": {
        "libvpx-vp9": {"crf": "28", "b": "0", "deadline": "realtime", "cpu-used": "7"},
        "libvpx": {"crf": "8", "b": "8M", "deadline": "realtime", "cpu-used": "7"},
    },
}


class Video:
    """Writes H.264 (VP9 for ``.webm``), 4:2:0, BT.709, each picture once, at its own time.

    The frame rate is variable: each frame keeps its time in the show, so a recording with gaps or
    jitter plays with its own timing. An odd side grows by one pixel that repeats the edge.
    Transparent areas become black. Pictures that differ in size from the first one are scaled.

    The growing file is fragmented, one piece per second, and is playable if the program is killed.
    `close` turns it into an ordinary file with an index. With FFmpeg before version 8 it stays
    fragmented, which players accept as well.

    Args:
        path: ends in .mp4, .m4v, .mov, .mkv or .webm.
        rate: approximate frames per second: a hint for the encoder, and the duration of the last
            frame when it is the only one.
        pictures_a_second: pictures per second that the video needs; frames without a picture are
            skipped.
        sound: a WAV file of 16-bit PCM that is heard from the first picture on, AAC or Opus in the
            video; it is cut where the pictures end. None for a silent video.

    Raises:
        InputError: the suffix is unknown, PyAV or an encoder is missing, or the file cannot be
            written.
    """

    def __init__(
        self,
        path: Path,
        *,
        rate: float = 30.0,
        pictures_a_second: float = 60.0,
        sound: Path | None = None,
    ) -> None:
        self.pictures_a_second = pictures_a_second
        encoders = _ENCODERS[check_suffix(path, tuple(_ENCODERS))]
        check_writable(path)
        self._av = _import_av(path)
        self._path = path
        self._rate = Fraction(min(max(rate, 1.0), 1000.0)).limit_denominator(1001)
        self._encoder, self._options = _first_available(self._av, encoders, path)
        self._start = 0.0
        self._last: int | None = None  # presentation time of the newest frame [ticks]
        self._step = round(_TICKS / self._rate)  # its duration if it is the last one [ticks]
        self._stream: Any = None
        self._wav = sound
        self._sound: VideoSound | None = None
        kind = _CONTAINERS[path.suffix.lower()]
        with self._writing():
            self._file = VideoFile(path)
            self._container: Any = self._av.open(
                self._file, "w", format=kind, options=_container_options(self._av, kind, sound)
            )

    def write(self, frame: PerformedFrame) -> None:
        """Encode the frame's picture, if it has one.

        Raises:
            InputError: the disk fails.
        """
        if frame.picture is None:
            return
        if self._container is None:
            raise ValueError("the video is closed")
        picture = _even(premultiplied(frame.picture))  # on black
        with self._writing():
            if self._stream is None:
                self._start = frame.time
                self._stream = self._add_stream(*picture.shape[1::-1])
            encoded = self._av.VideoFrame.from_ndarray(picture, format="rgba").reformat(
                width=self._stream.width,
                height=self._stream.height,
                format="yuv420p",
                dst_colorspace="ITU709",
            )
            encoded.time_base = Fraction(1, _TICKS)
            encoded.pts, encoded.duration = self._place(frame.time)
            with self._file.piece():
                if self._sound is not None:
                    self._sound.advance(frame.time - self._start)
                self._container.mux(self._stream.encode(encoded))

    def close(self) -> None:
        """Finish the file; a show without frames leaves no file.

        Raises:
            InputError: the disk fails.
        """
        container, self._container = self._container, None
        if container is None:
            return
        with self._writing(), closing(self._file):
            try:
                if self._stream is not None and not self._file.abandoned:
                    with self._file.piece():
                        container.mux(self._stream.encode(None))
                        if self._sound is not None and self._last is not None:
                            self._sound.finish((self._last + self._step) / _TICKS)
            finally:
                if self._sound is not None:
                    self._sound.close()
                with self._file.piece():
                    container.close()
        if self._stream is None and self._path.is_file():
            self._path.unlink()

    def _place(self, time: float) -> tuple[int, int]:
        """Return the presentation time of a frame, and its duration if it is the last [ticks]."""
        ticks = round(_TICKS * (time - self._start))
        if self._last is None:
            self._last = ticks
            return ticks, self._step
        shown = max(ticks, self._last + _SHORTEST)
        self._step, self._last = shown - self._last, shown
        return shown, self._step

    def _add_stream(self, width: int, height: int) -> Any:
        stream = self._container.add_stream(self._encoder, rate=self._rate, options=self._options)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        codec = stream.codec_context
        codec.time_base = Fraction(1, _TICKS)
        codec.max_b_frames = 0  # B-frames would delay the first frame by their reordering
        codec.gop_size = max(1, round(self._rate))  # a key frame, and so a fragment, a second
        codec.color_primaries = codec.color_trc = codec.colorspace = _BT709
        codec.color_range = _LIMITED_RANGE
        if self._wav is not None:
            suffix = self._path.suffix.lower()
            self._sound = VideoSound(self._av, self._container, self._wav, suffix)
        return stream

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            with writing(self._path):
                try:
                    yield
                except self._av.FFmpegError as error:
                    raise self._file.error or error from error
        except self._av.FFmpegError as error:
            raise InputError(f"cannot write {self._path}: {error.strerror or error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def encoder_for(path: Path) -> str:
    """Return the name of the encoder for a video at `path`.

    Raises:
        InputError: the suffix is unknown, or PyAV or an encoder is missing.
    """
    encoders = _ENCODERS[check_suffix(path, tuple(_ENCODERS))]
    return _first_available(_import_av(path), encoders, path)[0]


def _import_av(path: Path) -> Any:
    try:
        import av  # noqa: PLC0415  # an optional extra
    except ImportError as error:
        raise InputError(
            f"cannot write {path}: video needs the extra: pip install 'bunraku[video]'"
        ) from error
    return av


def _first_available(
    av: Any, encoders: dict[str, dict[str, str]], path: Path
) -> tuple[str, dict[str, str]]:
    """Return the first encoder that this FFmpeg has, and its options."""
    for name, options in encoders.items():
        if name in av.codecs_available:
            return name, options
    raise InputError(
        f"cannot write {path}: this PyAV has none of the encoders {', '.join(encoders)}; "
        f"pip install --force-reinstall av, or choose another suffix"
    )


def _container_options(av: Any, kind: str, sound: Path | None) -> dict[str, str]:
    """Return muxer flags that make every second of the file readable once it is written.

    AAC begins before the first sample. Without an edit list that says so, all pictures are shown
    later in place of it.
    """
    if kind not in ("mp4", "mov"):
        return {"flush_packets": "1"}  # Matroska clusters are independent
    hybrid = av.library_versions["libavformat"] >= (62,)
    flags = "hybrid_fragmented" if hybrid else "frag_keyframe+empty_moov+default_base_moof"
    begins = {} if sound is None else {"use_editlist": "1"}
    return {"movflags": flags, "flush_packets": "1", **begins}


def _even(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Pad the picture to even sides, as 4:2:0 requires, by repeating its last pixels."""
    height, width = picture.shape[:2]
    if height % 2 == 0 and width % 2 == 0:
        return picture
    return np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
