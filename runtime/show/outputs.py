"""The files and senders of a show: checked before it begins, then opened for each character."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.bounds import check_recordable
from runtime.characters.character import Character
from runtime.output.files.export import SUFFIXES, open_export
from runtime.output.files.frames import Frames
from runtime.output.files.kept_file import KeptFile
from runtime.output.files.point_cache import PointCache
from runtime.output.files.video import Video, encoder_for
from runtime.output.files.whole_file import check_suffix, check_writable
from runtime.output.live.bridge_performer import BridgePerformer
from runtime.output.live.bridge_publisher import BoundEndpoint, BridgePublisher, binding
from runtime.output.live.broadcast import Broadcast, Sender
from runtime.output.live.ndi import NdiSender, import_cyndilib
from runtime.output.live.shared_texture import import_shared_texture, open_shared_texture
from runtime.output.live.virtual_camera import VirtualCamera, import_pyvirtualcam
from runtime.output.live.vmc_performer import PORT as VMC_PORT
from runtime.output.live.vmc_performer import VmcPerformer
from runtime.output.output import Output
from runtime.output.report.report import CharacterReport
from runtime.show.messages import say
from runtime.show.settings import SenderSettings, ShowSettings

OF_EACH_CHARACTER = ("cache", "export")
"""Settings of files that several characters write one each of."""


def check_outputs(
    settings: ShowSettings, characters: Sequence[str], read: Sequence[tuple[str, Path]] = ()
) -> None:
    """Make sure that every file and sender of a show can be opened.

    Args:
        settings: of the show.
        characters: their names.
        read: files that the show reads and must not write, each with the name of its option.

    Raises:
        InputError: a folder is missing, a file cannot be written, a suffix is unknown, two options
            name one file, a library is missing, or an address beyond this machine has no keys.
    """
    written = list(_written(settings, characters))
    for option, path in written:
        if option == "--record":
            check_recordable(path)
        check_writable(path / "000000.png" if option == "--frames" and path.is_dir() else path)
    if settings.files.video is not None:
        encoder_for(settings.files.video)
    if settings.files.export is not None:
        check_suffix(settings.files.export, SUFFIXES)
    _check_senders(settings.senders)
    if settings.match.mapping is not None:
        read = [*read, ("--mapping", settings.match.mapping)]
    for (option, path), (other, taken) in itertools.combinations([*read, *written], 2):
        if (other, taken) in written and _same(path, taken):
            raise InputError(
                f"{other} cannot write {taken}: {option} is the same file; give each its own"
            )


def open_outputs(
    settings: ShowSettings,
    characters: Sequence[tuple[Character, CharacterReport]],
    performer: Skeleton,
    rate: float,
    closing: ExitStack,
    *,
    warn: Callable[[str], None],
) -> list[list[Output]]:
    """Open the outputs of each character; those of the pictures go with the first.

    Args:
        settings: of the show.
        characters: each with its part of the report.
        performer: the skeleton of all performers.
        rate: about how many frames a second will come.
        closing: closes what was opened.
        warn: takes a line about a file or sender that fails during the show.

    Raises:
        InputError: a suffix is unknown, a library is missing, or a file cannot be written.
    """
    files, senders = settings.files, settings.senders

    def kept(path: Path, output: Output, *, at_the_end: bool = False) -> KeptFile:
        file = KeptFile(path, output, at_the_end=at_the_end, tell=warn)
        return closing.enter_context(file)

    names = distinct_names([character.name for character, _ in characters])
    outputs: list[list[Output]] = []
    for name, (character, part) in zip(names, characters, strict=True):
        own: list[Output] = [part]
        if files.export is not None:
            path = _of(files.export, name, names)
            export = open_export(path, character, rate=rate, within=files.export_within)
            own.append(kept(path, export, at_the_end=True))
        if files.cache is not None:
            path = _of(files.cache, name, names)
            own.append(kept(path, PointCache(path, character)))
        outputs.append(own)
    if files.video is not None:
        video = Video(
            files.video, rate=rate, pictures_a_second=settings.fps, sound=files.video_sound
        )
        outputs[0].append(kept(files.video, video))
        if settings.transparent:
            warn(f"{files.video} is black where it is transparent: --frames keeps transparency")
    if files.frames is not None:
        outputs[0].append(kept(files.frames, Frames(files.frames)))
    for broadcast in _open_broadcasts(settings, warn):
        outputs[0].append(closing.enter_context(broadcast))
    if senders.publish is not None:
        publisher = open_publisher(_endpoint(senders), performer)
        outputs[0].append(closing.enter_context(BridgePerformer(publisher)))
    if senders.vmc is not None:
        host, port = senders.vmc
        first = VmcPerformer(performer, host, port or VMC_PORT)
        outputs[0].append(closing.enter_context(first))
    return outputs


def open_publisher(endpoint: BoundEndpoint, skeleton: Skeleton) -> BridgePublisher:
    """Open a publisher that says where it can be reached, and which subscribers come and go.

    Raises:
        InputError: the address cannot be bound.
    """
    publisher = BridgePublisher(endpoint, skeleton, report=say)
    say(f"sending to whoever opens zmq+{publisher.endpoint}")
    return publisher


def distinct_names(characters: Sequence[str]) -> list[str]:
    """The names of the characters' files; a name that comes again is numbered."""
    names: list[str] = []
    met: Counter[str] = Counter()
    for character in characters:
        met[character] += 1
        count = met[character]
        names.append(character if count == 1 else f"{character}-{count}")
    return names


def _check_senders(senders: SenderSettings) -> None:
    if senders.virtual_camera is not None:
        import_pyvirtualcam()
    if senders.spout is not None:
        import_shared_texture()
    if senders.ndi is not None:
        import_cyndilib()
    if senders.publish is not None:
        _endpoint(senders)


def _open_broadcasts(settings: ShowSettings, warn: Callable[[str], None]) -> Iterator[Broadcast]:
    """Open each sender of pictures that the settings ask for."""
    senders, size, rate = settings.senders, settings.size, settings.fps

    def broadcast(name: str, sender: Sender) -> Broadcast:
        return Broadcast(name, sender, size, rate, tell=warn)

    if senders.virtual_camera is not None:
        camera = VirtualCamera(senders.virtual_camera, size, rate)
        yield broadcast("the virtual camera", camera)
    if senders.spout is not None:
        yield broadcast("the shared picture", open_shared_texture(senders.spout, size))
    if senders.ndi is not None:
        sender = NdiSender(senders.ndi, size, rate, alpha=settings.transparent)
        yield broadcast("NDI", sender)


def _endpoint(senders: SenderSettings) -> BoundEndpoint:
    assert senders.publish is not None
    return binding(senders.publish, senders.publish_keys, option="--publish-keys DIR/capture")


def _written(settings: ShowSettings, characters: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """Each file and folder that the show writes, with the name of its option."""
    names = distinct_names(characters)
    for option in ("video", "frames", "cache", "report", "record", "export"):
        path: Path | None = getattr(settings.files, option)
        if path is None:
            continue
        if option not in OF_EACH_CHARACTER:
            yield f"--{option}", path
            continue
        for name in names:
            yield f"--{option}", _of(path, name, names)


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
