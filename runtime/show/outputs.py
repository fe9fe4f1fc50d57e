"""Which files a show writes: all of them known, and known to be possible, before it begins."""

from __future__ import annotations

import argparse
import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from devices.errors import InputError
from runtime.characters.character import Character
from runtime.cli.bridge import open_publisher
from runtime.driving.performer import Performer
from runtime.output.files.export import SUFFIXES, open_export
from runtime.output.files.frames import Frames
from runtime.output.files.point_cache import PointCache
from runtime.output.files.video import Video, encoder_for
from runtime.output.files.whole_file import check_suffix, check_writable
from runtime.output.live.bridge_performer import BridgePerformer
from runtime.output.live.bridge_publisher import BoundEndpoint, binding
from runtime.output.live.broadcast import Broadcast, Sender
from runtime.output.live.ndi import NdiSender, import_cyndilib
from runtime.output.live.shared_texture import import_shared_texture, open_shared_texture
from runtime.output.live.virtual_camera import VirtualCamera, import_pyvirtualcam
from runtime.output.live.vmc_performer import PORT as VMC_PORT
from runtime.output.live.vmc_performer import VmcPerformer
from runtime.output.output import Output
from runtime.output.report.report import CharacterReport
from runtime.show.warn import warn


def check_outputs(options: argparse.Namespace) -> None:
    """Make sure that every file of a show can be written, each once and over nothing it reads.

    Raises:
        InputError: a folder is missing, a file cannot be written, a suffix is not known, two
            options name one file, or what is published beyond this machine is not guarded.
    """
    read = list(_read(options))
    written = list(_written(options))
    for option, path in written:
        check_writable(path / "000000.png" if option == "--frames" and path.is_dir() else path)
    if options.video is not None:
        encoder_for(options.video)
    if options.virtual_camera is not None:
        import_pyvirtualcam()
    if options.spout is not None:
        import_shared_texture()
    if options.ndi is not None:
        import_cyndilib()
    if options.publish is not None:
        _publishing(options)
    if options.export is not None:
        check_suffix(options.export, SUFFIXES)
    for (option, path), (other, taken) in itertools.combinations(read + written, 2):
        if (other, taken) in written and _same(path, taken):
            raise InputError(
                f"{other} cannot write {taken}: {option} is the same file; give each its own"
            )


def open_outputs(
    options: argparse.Namespace,
    cast: Sequence[tuple[Character, CharacterReport]],
    performers: Sequence[Performer],
    rate: float,
    closing: ExitStack,
) -> list[list[Output]]:
    """What keeps each character's performance; the pictures of all go with the first.

    Args:
        options: of the command line.
        cast: the characters, each with its part of the report.
        performers: who drive them, the lead first.
        rate: about how many frames a second will come.
        closing: closes what was opened.

    Raises:
        InputError: a suffix is not known, a library is missing, or a file cannot be written.
    """
    names = _names(options.character)
    outputs: list[list[Output]] = []
    for name, (character, part) in zip(names, cast, strict=True):
        kept: list[Output] = [part]
        if options.export is not None:
            export = open_export(_of(options.export, name, names), character, rate=rate)
            kept.append(closing.enter_context(export))
        if options.cache is not None:
            cache = PointCache(_of(options.cache, name, names), character)
            kept.append(closing.enter_context(cache))
        outputs.append(kept)
    if options.video is not None:
        video = Video(options.video, rate=rate, pictures_a_second=options.fps)
        outputs[0].append(closing.enter_context(video))
    if options.frames is not None:
        outputs[0].append(closing.enter_context(Frames(options.frames)))
    for broadcast in _open_broadcasts(options):
        outputs[0].append(closing.enter_context(broadcast))
    if options.publish is not None:
        publisher = open_publisher(_publishing(options), performers[0].skeleton)
        outputs[0].append(closing.enter_context(BridgePerformer(publisher)))
    if options.vmc is not None:
        host, port = options.vmc
        lead = VmcPerformer(performers[0].skeleton, host, port or VMC_PORT)
        outputs[0].append(closing.enter_context(lead))
    return outputs


def needs_pictures(options: argparse.Namespace) -> bool:
    """Whether anything that a show writes or sends is made of pictures."""
    asked = (options.video, options.frames, options.virtual_camera, options.spout, options.ndi)
    return any(option is not None for option in asked)


def _open_broadcasts(options: argparse.Namespace) -> Iterator[Broadcast]:
    """What takes pictures to other programs, each opened as it is asked for."""
    size, rate = options.size, options.fps

    def broadcast(name: str, sender: Sender) -> Broadcast:
        return Broadcast(name, sender, size, rate, tell=warn)

    if options.virtual_camera is not None:
        camera = VirtualCamera(options.virtual_camera, size, rate)
        yield broadcast("the virtual camera", camera)
    if options.spout is not None:
        yield broadcast("the shared picture", open_shared_texture(options.spout, size))
    if options.ndi is not None:
        sender = NdiSender(options.ndi, size, rate, alpha=options.transparent)
        yield broadcast("NDI", sender)


def _publishing(options: argparse.Namespace) -> BoundEndpoint:
    return binding(options.publish, options.publish_keys, option="--publish-keys DIR/capture")


def _read(options: argparse.Namespace) -> Iterator[tuple[str, Path]]:
    """Each file that the show reads, and what the command line calls it."""
    if getattr(options, "recording", None) is not None:
        yield "RECORDING", options.recording
    for name in options.character:
        yield "--character", Path(name)
    if options.mapping is not None:
        yield "--mapping", options.mapping


def _written(options: argparse.Namespace) -> Iterator[tuple[str, Path]]:
    """Each file and folder that the show writes, and the option that asks for it."""
    names = _names(options.character)
    for option in ("video", "frames", "cache", "report", "record", "export"):
        path: Path | None = getattr(options, option)
        if path is not None:
            for name in names if option in ("cache", "export") else names[:1]:
                own = _of(path, name, names) if option in ("cache", "export") else path
                yield f"--{option}", own


def _names(characters: Sequence[str]) -> list[str]:
    """What tells the characters' files apart: their names, numbered where one comes again."""
    names: list[str] = []
    met: Counter[str] = Counter()
    for character in characters:
        stem = Path(character).stem
        met[stem] += 1
        names.append(stem if met[stem] == 1 else f"{stem}-{met[stem]}")
    return names


def _of(path: Path, name: str, names: Sequence[str]) -> Path:
    """The file for one of several characters: OUT-squid.pc2 beside OUT.pc2."""
    if len(names) == 1:
        return path
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


def _same(path: Path, other: Path) -> bool:
    """Whether two paths lead to one file that is kept; a device such as /dev/null may be shared."""
    if path.exists() and other.exists():
        return path.samefile(other) and (path.is_file() or path.is_dir())
    return path.resolve() == other.resolve()
