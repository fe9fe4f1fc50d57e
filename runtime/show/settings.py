"""The settings of a show, with their units, defaults and limits; checked when they are made."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from devices.errors import InputError
from runtime.conditioning.switches import SWITCHES
from runtime.control.flow_settings import FlowSettings
from runtime.driving.by_hand.pair_words import WordedPair
from runtime.render.background import Background

LEAST_SIDE, MOST_SIDE = 16, 8192  # pixels of a picture's width and height
MOST_VOLUME_GAIN = 10.0
MOST_PORT = 65535
PORTS = f"0 to {MOST_PORT}"
MOST_STIFFNESS = 0.99  # with 1 a limb could not bend at all, and the solver would have no answer
DRIVES = ("auto", "relative", "absolute")
ENERGIES = ("spokes", "spokes-and-rims", "smooth-rotations")

Address = tuple[str, int | None]
"""A host and a port; without a port the usual one of the protocol."""


@dataclass(frozen=True, slots=True)
class CharacterSettings:
    """How one character deforms.

    Attributes:
        cartoon: 0 keeps every part rigid; 1 lets it squash and stretch with its motion.
        volume_gain: share of the volume lost while it squashes and stretches that is restored, 0
            to 10; more than 1 exaggerates.
        stiffness: 0 lets limbs bend along their whole length; towards 1 they bend at their joints
            only; 0 to 0.99.
        energy: what the solver keeps as rigid as possible, one of `ENERGIES`.
        iterations: ARAP iterations a frame, from 1; of several, the last runs after the frame is
            shown.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    cartoon: float = 0.0
    volume_gain: float = 1.0
    stiffness: float = 0.0
    energy: str = ENERGIES[0]
    iterations: int = 2

    def __post_init__(self) -> None:
        _check_range(self, "cartoon", 0.0, 1.0)
        _check_range(self, "volume_gain", 0.0, MOST_VOLUME_GAIN)
        _check_range(self, "stiffness", 0.0, MOST_STIFFNESS)
        if self.energy not in ENERGIES:
            raise _refusal(self, "energy", f"one of {', '.join(ENERGIES)}")
        _check_count(self, "iterations")


@dataclass(frozen=True, slots=True)
class MatchSettings:
    """How performers are matched to characters.

    Attributes:
        source: the part of the performer that drives: a preset such as "whole" or "left-arm", or
            joint names with commas between them.
        performers: how many performers drive; performer K drives character K, and the last one
            also drives all remaining characters.
        rank: which match is shown first; 1 is the best.
        mapping: a JSON file that pairs joints and nodes by hand, or None to match.
        pairs: what drives what in words, as "left arm -> tentacle 3"; none to match.
        extend: drive a matched chain on to its longest leaf, or stop at the root of the sub-tree.
        flip: flip the y-axis of the targets, which mirrors the turns.
        driver: how characters follow, a name in `runtime.driving.drivers.DRIVERS`: "absolute"
            points each limb where the performer's points, "relative" turns matched chains from a
            rest pose, "auto" is absolute where both bodies have such limbs.
        in_place: characters stay where they are instead of travelling as their performers do.
        rehearse: look through a recording for the pose to start from; False matches a recording as
            it matches a live performer.
        patience: [s] that a performer must keep still, with the same match shown, before it
            performs by itself; 0 at once, infinite only when it is accepted. None: at once for a
            recording, and until it is accepted where a recording is matched again; after 3 s for a
            live performer, after 1 s and without keeping still where there is no window.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    source: str = "whole"
    performers: int = 1
    rank: int = 1
    mapping: Path | None = None
    pairs: tuple[WordedPair, ...] = ()
    extend: bool = True
    flip: bool = False
    driver: str = "auto"
    in_place: bool = False
    rehearse: bool = True
    patience: float | None = None

    def __post_init__(self) -> None:
        _check_count(self, "performers")
        _check_count(self, "rank")
        _check_path(self, "mapping")
        if self.patience is not None:
            _check_range(self, "patience", 0.0, math.inf)


@dataclass(frozen=True, slots=True)
class FileSettings:
    """The files that a show writes; None writes no such file.

    With several characters `cache` and `export` write a file for each, with the character's name
    before the suffix.

    Attributes:
        video: pictures as .mp4, .m4v, .mov, .mkv or .webm.
        frames: a folder for a PNG of each frame.
        cache: the deformed vertices as a PC2 point cache.
        report: figures of the show as JSON.
        record: the performer's frames as MCAP, from the first frame on.
        export: the performed character as .glb, .usdc, .usda or .bvh.
        export_within: how far the surface of a .glb, or a joint of a .bvh, may be from where it
            was performed, as a share of the height; None for a skin alone, or rigid bones.
        video_sound: a WAV file of 16-bit PCM that is heard in the video, from its first picture on.
        takes: recordings that are started while the show runs are called ``NAME-1.mcap`` and so on
            beside this one; None: beside `record`, or ``take.mcap`` in the current folder.

    Raises:
        InputError: a value is no `Path`; the message names the setting.
    """

    video: Path | None = None
    frames: Path | None = None
    cache: Path | None = None
    report: Path | None = None
    record: Path | None = None
    export: Path | None = None
    export_within: float | None = None
    video_sound: Path | None = None
    takes: Path | None = None

    def __post_init__(self) -> None:
        for name in (
            "video",
            "frames",
            "cache",
            "report",
            "record",
            "export",
            "video_sound",
            "takes",
        ):
            _check_path(self, name)


@dataclass(frozen=True, slots=True)
class SenderSettings:
    """What a show sends to other programs while it runs; None sends nothing.

    Attributes:
        virtual_camera: the virtual camera that shows the pictures; "" is the first one there is.
        ndi: name under which NDI sends the pictures over the network.
        spout: name under which Spout (Windows) or Syphon (macOS) shares the pictures.
        vmc: where to send the first performer as VMC; the usual port is 39539.
        publish: ``tcp://HOST:PORT`` at which other shows find the performers.
        publish_keys: folder with the keys that `publish` needs beyond this machine.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    virtual_camera: str | None = None
    ndi: str | None = None
    spout: str | None = None
    vmc: Address | None = None
    publish: str | None = None
    publish_keys: Path | None = None

    def __post_init__(self) -> None:
        if self.vmc is not None:
            _check_address(self, "vmc")
        _check_path(self, "publish_keys")


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """Remote control by OSC.

    Attributes:
        address: where the show listens; the usual port is 9100.
        feedback_port: where the remote control listens; None: the port that it sends from.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    address: Address
    feedback_port: int | None = None

    def __post_init__(self) -> None:
        _check_address(self, "address")
        if self.feedback_port is not None and not _is_port(self.feedback_port):
            raise _refusal(self, "feedback_port", PORTS)


@dataclass(frozen=True, slots=True)
class KioskSettings:
    """A show that nobody operates.

    Attributes:
        patience: [s] after the last performer has left until the session plays again and again.
        pin: digits that an operator types to use the keys and the mouse; "" lets everybody.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    patience: float
    pin: str = ""

    def __post_init__(self) -> None:
        _check_range(self, "patience", 0.0, math.inf)
        pin: object = self.pin
        if not isinstance(pin, str) or (pin and not re.fullmatch(r"[0-9]{1,12}", pin)):
            raise _refusal(self, "pin", "1 to 12 digits, or an empty text")


@dataclass(frozen=True, slots=True)
class ShowSettings:
    """Everything about a show but its stream and its characters.

    Attributes:
        size: width and height of the pictures [px], 16 to 8192 each; in a window, its first size.
        window: open a window, with its keys and mouse.
        pictures: make `Show.picture` available without a window; needs OpenGL 3.3.
        background: a plain colour, or `runtime.render.background.NOTHING`, in place of the stage.
        plain: leave out the matched chains and the performer inset.
        fps: pictures a second of videos, cameras and senders, at most.
        match: how performers are matched to characters.
        characters: how the characters deform: one for each, or one for all.
        conditioning: steps of the conditioning to switch on or off, by the names of
            `runtime.conditioning.switches.Conditioning`; the others stay as is usual for a live
            stream or a recording.
        files: the files to write.
        senders: what to send to other programs.
        remote: remote control by OSC, or None.
        kiosk: of a session that nobody operates; None where somebody does.
        flow: how the show goes on from one step of the puppeteer to the next.
        origin: where the stream comes from, for the head of recordings: an address or a file name.

    Raises:
        InputError: a value is out of range; the message names the setting.
    """

    size: tuple[int, int] = (960, 540)
    window: bool = False
    pictures: bool = False
    background: Background | None = None
    plain: bool = False
    fps: float = 60.0
    match: MatchSettings = field(default_factory=MatchSettings)
    characters: tuple[CharacterSettings, ...] = field(
        default_factory=lambda: (CharacterSettings(),)
    )
    conditioning: Mapping[str, bool] = field(default_factory=dict)
    files: FileSettings = field(default_factory=FileSettings)
    senders: SenderSettings = field(default_factory=SenderSettings)
    remote: RemoteSettings | None = None
    kiosk: KioskSettings | None = None
    flow: FlowSettings = field(default_factory=FlowSettings)
    origin: str = ""

    def __post_init__(self) -> None:
        size: object = self.size
        if not isinstance(size, tuple) or len(size) != 2 or not all(map(_is_side, size)):
            raise _refusal(self, "size", f"two whole numbers from {LEAST_SIDE} to {MOST_SIDE}")
        if not _is_number(self.fps) or not 0.0 < self.fps < math.inf:
            raise _refusal(self, "fps", "a finite number above 0")
        if not isinstance(self.background, Background | None):
            raise _refusal(self, "background", "a Background or None")
        own: object = self.characters
        if (
            not isinstance(own, tuple)
            or not own
            or not all(isinstance(one, CharacterSettings) for one in own)
        ):
            raise _refusal(self, "characters", "a tuple of CharacterSettings, one at least")
        if not all(isinstance(on, bool) for on in self.conditioning.values()):
            raise _refusal(self, "conditioning", "True or False for each step")
        unknown = sorted(set(self.conditioning) - set(SWITCHES))
        if unknown:
            raise InputError(
                f"ShowSettings.conditioning: no step is called {unknown[0]!r}; there are: "
                f"{', '.join(SWITCHES)}"
            )

    @property
    def transparent(self) -> bool:
        """Whether pictures show nothing behind the characters."""
        return self.background is not None and self.background.alpha == 0

    @property
    def is_noticed(self) -> bool:
        """Whether the show has a window, file, sender or remote, so that it has any effect."""
        # Neither of these writes anything by itself.
        files = replace(self.files, export_within=None, video_sound=None)
        asked: list[object] = [
            *(getattr(files, each.name) for each in fields(files)),
            *(getattr(self.senders, each.name) for each in fields(self.senders)),
            self.remote,
        ]
        return self.window or any(one is not None for one in asked)

    @property
    def needs_pictures(self) -> bool:
        """Whether the show draws without a window: for a file, a sender or `Show.picture`."""
        files, senders = self.files, self.senders
        asked = (files.video, files.frames, senders.virtual_camera, senders.spout, senders.ndi)
        return self.pictures or any(one is not None for one in asked)


Settings = (
    CharacterSettings
    | MatchSettings
    | FileSettings
    | SenderSettings
    | RemoteSettings
    | KioskSettings
    | ShowSettings
)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_side(value: object) -> bool:
    return isinstance(value, int) and LEAST_SIDE <= value <= MOST_SIDE


def _is_port(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_PORT


def _check_address(settings: Settings, name: str) -> None:
    value: object = getattr(settings, name)
    if (
        not isinstance(value, tuple)
        or len(value) != 2
        or not isinstance(value[0], str)
        or not (value[1] is None or _is_port(value[1]))
    ):
        raise _refusal(settings, name, f"a host and a port, {PORTS}, or None for the usual one")


def _check_range(settings: Settings, name: str, low: float, high: float) -> None:
    value = getattr(settings, name)
    if not _is_number(value) or not low <= value <= high:
        raise _refusal(settings, name, f"a number from {low:g} to {high:g}")


def _check_count(settings: Settings, name: str) -> None:
    value = getattr(settings, name)
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= 1_000_000:
        raise _refusal(settings, name, "a whole number from 1")


def _check_path(settings: Settings, name: str) -> None:
    if not isinstance(getattr(settings, name), Path | None):
        raise _refusal(settings, name, "a pathlib.Path")


def _refusal(settings: Settings, name: str, expected: str) -> InputError:
    value = getattr(settings, name)
    return InputError(f"{type(settings).__name__}.{name}: expected {expected}, got {value!r}")


def check_characters(settings: ShowSettings, count: int) -> None:
    """Refuse settings that do not fit a show of `count` characters.

    Raises:
        InputError: there is no character, or too few or too many settings of characters.
    """
    performers = settings.match.performers
    if count == 0:
        raise InputError("a show needs at least one character, got none")
    if performers > count:
        raise InputError(
            f"MatchSettings.performers: {performers} performers need as many characters, "
            f"got {count}"
        )
    if len(settings.characters) not in (1, count):
        raise InputError(
            f"ShowSettings.characters: expected the settings of all {count} characters or of one "
            f"for all, got {len(settings.characters)}"
        )
