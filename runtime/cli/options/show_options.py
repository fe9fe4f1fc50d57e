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
from runtime.cli.options.output_options import (
    add_file_options,
    add_sender_options,
    file_settings,
    sender_settings,
)
from runtime.conditioning.switches import STEPS, SWITCHES
from runtime.render.background import NOTHING, Background
from runtime.show.settings import (
    DRIVES,
    ENERGIES,
    CharacterSettings,
    MatchSettings,
    RemoteSettings,
    ShowSettings,
)

USUALLY = {
    "filter": "; off by default for recordings",
    "predict": "; off by default",
    "level": "; off by default for recordings",
    "mirror": "; off by default",
    "scale": "; off by default for recordings",
    "recalibrate": "; off by default",
}
"""When a switch of the conditioning is off, unless it is asked for."""


def add_character_option(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add the option that names the characters."""
    parser.add_argument(
        "--character",
        action="append",
        required=required,
        metavar="C",
        help="a mesh (obj, ply, stl, off, mesh, glb, gltf, vrm) or a built-in character; may be "
        "repeated",
    )


def add_show_options(parser: argparse.ArgumentParser) -> None:
    """Add every option of a show."""
    _add_stage(parser)
    _add_remote(parser)
    _add_conditioning(parser)
    _add_driving(parser)
    _add_match(parser)
    _add_deformation(parser)
    add_file_options(parser)
    add_sender_options(parser)


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
        origin=origin,
    )


def _refuse_matching_without_chains(options: argparse.Namespace) -> None:
    """Refuse a choice of matched chains beside a way of driving that has none."""
    asked = {
        "--match": options.match > 1,
        "--mapping": options.mapping is not None,
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


def _remote(options: argparse.Namespace) -> RemoteSettings | None:
    if options.remote is None:
        if options.remote_feedback is not None:
            raise InputError("--remote-feedback answers a remote control: add --remote")
        return None
    return RemoteSettings(options.remote, options.remote_feedback)


def _add_stage(parser: argparse.ArgumentParser) -> None:
    show = parser.add_argument_group("the show")
    show.add_argument("--headless", action="store_true", help="open no window")
    show.add_argument(
        "--fast",
        action="store_true",
        help="perform every frame exactly once, as fast as possible",
    )
    show.add_argument(
        "--speed",
        type=positive,
        default=1.0,
        metavar="X",
        help="play a recording X times as fast as it was recorded (default 1)",
    )
    show.add_argument(
        "--loop", action="store_true", help="start a recording again after its last frame"
    )
    add_picture_options(parser)


def add_picture_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the picture: its size, and what stands behind the characters."""
    show = parser.add_argument_group("the picture")
    show.add_argument(
        "--size",
        type=size,
        default=(960, 540),
        metavar="WxH",
        help="width and height of the picture in pixels (default 960x540; demo 1280x560)",
    )
    behind = show.add_mutually_exclusive_group()
    behind.add_argument(
        "--transparent", action="store_true", help="draw no stage behind the characters"
    )
    behind.add_argument(
        "--background",
        type=colour,
        metavar="COLOUR|chroma",
        help="draw a plain colour such as #203040 in place of the stage; chroma is a green that is "
        "easy to key out",
    )
    show.add_argument(
        "--plain",
        action="store_true",
        help="draw neither the matched chains nor the performer's small picture",
    )


def _add_remote(parser: argparse.ArgumentParser) -> None:
    show = parser.add_argument_group("remote control")
    show.add_argument(
        "--remote",
        type=remote_address,
        metavar="HOST:PORT",
        help="accept OSC messages at this address: 127.0.0.1:9100 for programs on this machine, "
        "0.0.0.0:9100 for a phone",
    )
    show.add_argument(
        "--remote-feedback",
        type=port_number,
        metavar="PORT",
        help="send states to this port of the phone (default: the port that it sends from)",
    )


def _add_conditioning(parser: argparse.ArgumentParser) -> None:
    stream = parser.add_argument_group("corrections of the performer's frames")
    for name, (label, text) in STEPS.items():
        said = f"{label}: {text}{USUALLY.get(name, '')}"
        stream.add_argument(f"--{name}", action=argparse.BooleanOptionalAction, help=said)


def _add_driving(parser: argparse.ArgumentParser) -> None:
    drive = parser.add_argument_group("who drives, and how the characters follow")
    drive.add_argument(
        "--source",
        default="whole",
        metavar="PRESET|JOINTS",
        help="the part of the performer that drives: whole, upper, arms, legs, left-arm, "
        "right-arm, hand, ... or joint names separated by commas (default whole)",
    )
    drive.add_argument(
        "--drive",
        choices=DRIVES,
        default="auto",
        help="how a character follows: absolute points each limb where the performer's points, "
        "relative turns matched chains from a rest pose, auto (default) is absolute where both "
        "have such limbs",
    )
    drive.add_argument(
        "--in-place",
        action="store_true",
        help="let characters stay where they are; else they travel as their performers do",
    )
    drive.add_argument(
        "--performers",
        type=counting,
        default=1,
        metavar="N",
        help="number of performers: performer K drives character K, and the last performer also "
        "drives all remaining characters (default 1)",
    )


def _add_match(parser: argparse.ArgumentParser) -> None:
    match = parser.add_argument_group(
        "matching chains of the performer to the characters",
        "All but --iterations choose matched chains also for bodies that else follow limb by limb.",
    )
    match.add_argument(
        "--match",
        type=counting,
        default=1,
        metavar="N",
        help="use the N-th best match (default 1)",
    )
    match.add_argument(
        "--countdown",
        type=seconds_or_never,
        metavar="S|never",
        help="seconds that a performer keeps still before the match shown performs; never waits "
        "for Enter (default 3; a recording starts at once)",
    )
    match.add_argument(
        "--mapping",
        type=Path,
        metavar="FILE.json",
        help="use the pairs of joints and nodes in this file; see docs/mapping.md",
    )
    match.add_argument(
        "--chains",
        choices=("extend", "stop"),
        default="extend",
        help="drive a matched chain to its longest leaf, or only to the root of the sub-tree "
        "(default extend)",
    )
    match.add_argument(
        "--flip", action="store_true", help="mirror the turns by flipping the y-axis"
    )
    match.add_argument(
        "--iterations",
        type=counting,
        default=2,
        metavar="N",
        help="ARAP iterations per frame; if N is 2 or more, the last one runs after the frame is "
        "shown (default 2)",
    )


def _add_deformation(parser: argparse.ArgumentParser) -> None:
    made = parser.add_argument_group(
        "deformation of the characters",
        "Each option may be repeated, once for each character; the last value also applies to all "
        "remaining characters.",
    )
    made.add_argument(
        "--cartoon",
        action="append",
        type=share,
        metavar="X",
        help="0 (default) keeps every part rigid, 1 lets it squash and stretch with its motion",
    )
    made.add_argument(
        "--volume-gain",
        action="append",
        type=gain,
        metavar="X",
        help="share of the volume lost while a part squashes and stretches that is restored; more "
        "than 1 exaggerates (default 1)",
    )
    made.add_argument(
        "--stiffness",
        action="append",
        type=stiffness,
        metavar="X",
        help="0 (default) lets limbs bend along their whole length; the nearer to 1, the more they "
        "bend at their joints only",
    )
    made.add_argument(
        "--energy",
        action="append",
        choices=ENERGIES,
        help="what the solver keeps as rigid as possible (default spokes); see docs/deformation.md",
    )
