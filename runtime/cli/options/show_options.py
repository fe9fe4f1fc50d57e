"""The options of a show (`bunraku demo`, `replay`, `live`), and the settings they stand for."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from devices.errors import InputError
from runtime.cli.options.arguments import (
    colour,
    counting,
    gain,
    port_number,
    positive,
    remote_address,
    seconds_or_never,
    share,
    size,
    stiffness,
)
from runtime.cli.options.flow_options import add_flow_options, flow_settings
from runtime.cli.options.output_options import (
    add_file_options,
    add_record_option,
    add_sender_options,
    file_settings,
    sender_settings,
)
from runtime.conditioning.switches import STEPS, SWITCHES, for_live, for_recording
from runtime.driving.by_hand.pair_words import WordedPair, read_pair
from runtime.render.background import NOTHING, Background
from runtime.show.settings import (
    DRIVES,
    ENERGIES,
    CharacterSettings,
    MatchSettings,
    RemoteSettings,
    ShowSettings,
)


def add_character_option(group: argparse._ActionsContainer, *, default: str | None = None) -> None:
    """Add the option that names the characters.

    Args:
        group: of a command's options.
        default: what the help says of a command without the option; None where it must be given.
    """
    group.add_argument(
        "--character",
        action="append",
        required=default is None,
        metavar="C",
        help="a file (obj, ply, stl, off, mesh, glb, gltf, vrm) or a built-in character; repeat "
        f"the option for several{'' if default is None else f' (default: {default})'}",
    )


def add_show_options(parser: argparse.ArgumentParser) -> None:
    """Add every option of a show."""
    _add_window(parser)
    add_picture_options(parser)
    _add_driving(parser)
    _add_match(parser)
    add_flow_options(parser)
    _add_deformation(parser)
    _add_conditioning(parser)
    add_record_option(add_file_options(parser))
    add_sender_options(parser)
    _add_remote(parser)


def add_playback_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of how a recording is played."""
    played = parser.add_argument_group("how the recording is played")
    played.add_argument(
        "--speed",
        type=positive,
        default=1.0,
        metavar="X",
        help="play X times as fast as it was recorded (default: 1)",
    )
    played.add_argument("--loop", action="store_true", help="start again after the last frame")


def show_settings(options: argparse.Namespace, origin: str) -> ShowSettings:
    """The settings that the options of a command line ask for.

    Args:
        options: with those of `add_show_options`, and `character`, a list of names.
        origin: the address or name of the stream.

    Raises:
        InputError: options contradict each other.
    """
    count = len(options.character)
    if options.performers > count:
        raise InputError(
            f"--performers {options.performers} needs as many characters, got {count}; give "
            "--character more often"
        )
    _refuse_matching_without_chains(options)
    return ShowSettings(
        size=options.size,
        window=not options.headless,
        background=background_of(options),
        plain=options.plain,
        fps=options.fps,
        match=MatchSettings(
            source=options.source,
            performers=options.performers,
            rank=options.match,
            mapping=options.mapping,
            pairs=_pairs(options),
            extend=options.chains == "extend",
            flip=options.flip,
            driver=options.drive,
            in_place=options.in_place,
            patience=options.countdown,
        ),
        characters=tuple(_character(options, number) for number in range(count)),
        conditioning={
            name: getattr(options, name) for name in SWITCHES if getattr(options, name) is not None
        },
        files=file_settings(options),
        senders=sender_settings(options),
        remote=_remote(options),
        flow=flow_settings(options),
        origin=origin,
    )


def _refuse_matching_without_chains(options: argparse.Namespace) -> None:
    """Refuse a choice of matched chains beside a way of driving that has none."""
    asked = {
        "--match": options.match > 1,
        "--mapping": options.mapping is not None,
        "--map": bool(options.map),
        "--chains stop": options.chains == "stop",
        "--flip": options.flip,
    }
    if options.drive == "absolute" and any(asked.values()):
        option = next(name for name, given in asked.items() if given)
        raise InputError(
            f"{option} chooses matched chains, and --drive absolute has none; leave one of both out"
        )


def background_of(options: argparse.Namespace) -> Background | None:
    """The background that the options ask for; None for the stage."""
    if options.transparent:
        return NOTHING
    return None if options.background is None else Background(*options.background)


def _character(options: argparse.Namespace, number: int) -> CharacterSettings:
    """The settings of one character; the last value of an option is also for all that follow."""
    usual = CharacterSettings()

    def own(name: str) -> Any:
        values = getattr(options, name)
        return values[min(number, len(values) - 1)] if values else getattr(usual, name)

    return CharacterSettings(
        cartoon=own("cartoon"),
        volume_gain=own("volume_gain"),
        stiffness=own("stiffness"),
        energy=own("energy"),
        iterations=options.iterations,
    )


def _pairs(options: argparse.Namespace) -> tuple[WordedPair, ...]:
    if options.map and options.mapping is not None:
        raise InputError("--map and --mapping both say what drives what; leave one of both out")
    pairs = tuple(map(read_pair, options.map))
    if options.match != 1 and any(pair.character is None for pair in pairs):
        raise InputError(
            f"--match {options.match} chooses among matches, and with --map nothing is matched; "
            "leave one of both out"
        )
    return pairs


def _remote(options: argparse.Namespace) -> RemoteSettings | None:
    if options.remote is None:
        if options.remote_feedback is not None:
            raise InputError("--remote-feedback answers a remote control: add --remote")
        return None
    return RemoteSettings(options.remote, options.remote_feedback)


def _add_window(parser: argparse.ArgumentParser) -> None:
    show = parser.add_argument_group("the window")
    show.add_argument("--headless", action="store_true", help="open no window")
    show.add_argument(
        "--fast",
        action="store_true",
        help="perform every frame exactly once, as fast as possible",
    )
    show.add_argument(
        "--plain",
        action="store_true",
        help="draw neither the matched chains nor the performer's small picture",
    )


def add_picture_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the picture: its size, and what stands behind the characters."""
    show = parser.add_argument_group("the picture")
    show.add_argument(
        "--size",
        type=size,
        default="960x540",
        metavar="WxH",
        help="width and height of the picture in pixels (default: %(default)s)",
    )
    behind = show.add_mutually_exclusive_group()
    behind.add_argument(
        "--transparent", action="store_true", help="draw nothing behind the characters"
    )
    behind.add_argument(
        "--background",
        type=colour,
        metavar="COLOUR",
        help="draw this colour behind the characters: #203040, or chroma, a green that is easy to "
        "key out (default: the stage)",
    )


def _add_remote(parser: argparse.ArgumentParser) -> None:
    show = parser.add_argument_group("remote control")
    show.add_argument(
        "--remote",
        type=remote_address,
        metavar="HOST:PORT",
        help="accept OSC messages at this address: 127.0.0.1:9100 from programs on this machine, "
        "0.0.0.0:9100 also from a phone",
    )
    show.add_argument(
        "--remote-feedback",
        type=port_number,
        metavar="PORT",
        help="answer to this port of the phone (default: the port that it sends from)",
    )


def _add_conditioning(parser: argparse.ArgumentParser) -> None:
    stream = parser.add_argument_group("corrections of the performer's frames")
    for name, (label, text) in STEPS.items():
        stream.add_argument(
            f"--{name}",
            action=argparse.BooleanOptionalAction,
            help=f"{label}: {text} (default: {_usual(name)})",
        )


def _usual(name: str) -> str:
    """Where a correction is on, unless an option says otherwise."""
    live, recorded = getattr(for_live(), name), getattr(for_recording(), name)
    if name == "mirror":
        return "on for webcams, else off"
    if live != recorded:
        return "on, but off for recordings"
    return "on" if live else "off"


def _add_driving(parser: argparse.ArgumentParser) -> None:
    drive = parser.add_argument_group("how performers drive characters")
    drive.add_argument(
        "--source",
        default="whole",
        metavar="PART",
        help="the part of the performer that drives: whole, upper, arms, legs, left-arm, "
        "right-arm, hand, ..., or joint names with commas between them (default: whole)",
    )
    drive.add_argument(
        "--drive",
        choices=DRIVES,
        default="auto",
        help="absolute: each limb points where the performer's limb points; relative: matched "
        "chains turn from a rest pose; auto: absolute where both bodies have such limbs, else "
        "relative (default: auto)",
    )
    drive.add_argument(
        "--in-place",
        action="store_true",
        help="keep the characters where they are (default: they travel as their performers do)",
    )
    drive.add_argument(
        "--performers",
        type=counting,
        default=1,
        metavar="N",
        help="the number of performers; performer K drives character K, and the last one also "
        "drives all remaining characters (default: 1)",
    )


def _add_match(parser: argparse.ArgumentParser) -> None:
    match = parser.add_argument_group(
        "how performers are matched to characters",
        "With --drive auto, --match, --mapping, --chains stop and --flip select matched chains.",
    )
    match.add_argument(
        "--match",
        type=counting,
        default=1,
        metavar="N",
        help="use the N-th best match (default: 1)",
    )
    match.add_argument(
        "--countdown",
        type=seconds_or_never,
        metavar="S|never",
        help="start when the performer has kept still for S seconds, or never before Enter is "
        "pressed (default: 3, or 1 without a window; a recording starts at once)",
    )
    match.add_argument(
        "--mapping",
        type=Path,
        metavar="FILE.json",
        help="use the pairs of joints and nodes in this file, which docs/mapping.md describes",
    )
    match.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="PAIR",
        help="let a part of the performer drive a part of a character, in the words of the window: "
        "'left arm -> tentacle 3', or 'left arm -> squid: tentacle 3' for one of several "
        "characters; may be repeated (default: match)",
    )
    match.add_argument(
        "--chains",
        choices=("extend", "stop"),
        default="extend",
        help="extend: drive a matched chain to its longest leaf; stop: only to the root of the "
        "matched sub-tree (default: extend)",
    )
    match.add_argument(
        "--flip", action="store_true", help="flip the y-axis, which mirrors the turns"
    )


def _add_deformation(parser: argparse.ArgumentParser) -> None:
    made = parser.add_argument_group(
        "how characters deform",
        "Repeat an option to give each character its own value; the last value applies to all "
        "remaining characters. --iterations is for all characters.",
    )
    made.add_argument(
        "--cartoon",
        action="append",
        type=share,
        metavar="X",
        help="0 keeps every part rigid, 1 lets it squash and stretch with its motion (default: 0)",
    )
    made.add_argument(
        "--volume-gain",
        action="append",
        type=gain,
        metavar="X",
        help="restore this share of the volume that a part loses while it squashes and stretches; "
        "more than 1 exaggerates (default: 1)",
    )
    made.add_argument(
        "--stiffness",
        action="append",
        type=stiffness,
        metavar="X",
        help="0 lets limbs bend along their whole length; the nearer to 1, the more they bend only "
        "at their joints (default: 0)",
    )
    made.add_argument(
        "--energy",
        action="append",
        choices=ENERGIES,
        help="what the solver keeps as rigid as possible; docs/deformation.md describes each "
        "(default: spokes)",
    )
    made.add_argument(
        "--iterations",
        type=counting,
        default=2,
        metavar="N",
        help="iterations of the solver per frame; of several, the last runs after the frame is "
        "shown (default: 2)",
    )
