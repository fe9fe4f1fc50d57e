"""Opens a session for a show: its actors become the characters on the stage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from devices.errors import InputError
from runtime.driving.matching.puppet_match import PuppetMatch
from runtime.puppet.puppet import Puppet
from runtime.session.document import Actor, Session
from runtime.session.edits import with_actor
from runtime.session.files.store import SessionStore
from runtime.session.live_session import LiveSession, StagedActor
from runtime.session.live_setups import ActorSetup, LiveSetups
from runtime.session.versions import Versions
from runtime.show.act_group import Act, ActGroup


def open_session(
    store: SessionStore,
    acts: Sequence[Act],
    matching: ActGroup,
    drive: str,
    *,
    clock: Callable[[], float],
    tell: Callable[[str], None],
    warn: Callable[[str], None],
) -> LiveSession:
    """Connect a session with a show; a new session gets the show's characters as its actors.

    Actors that were set up before are so again.

    Args:
        store: where the session is kept.
        acts: each performer with their puppets.
        matching: knows which characters are selected; those are recorded.
        drive: how the characters are driven, which decides on their nodes.
        clock: host monotonic time [s].
        tell: takes one line of what happened.
        warn: takes one line about a fault.

    Raises:
        InputError: the session has other characters than the show, or the disk fails.
    """
    puppets = [puppet for act in acts for puppet in act.puppets]
    session = store.session
    if not session.actors:
        names = store.characters or [puppet.character.name for puppet in puppets]
        for number, (puppet, name) in enumerate(zip(puppets, names, strict=True), 1):
            session = with_actor(session, _actor(number, puppet, name, drive))
        store.versions = Versions(session)
    _check_actors(store.path, session, puppets, drive)
    for note in store.notes:
        warn(note)
    driven = [
        (actor.id, act, puppet, match)
        for actor, (act, puppet, match) in zip(
            session.actors,
            [
                (act, puppet, match)
                for act in acts
                for puppet, match in zip(act.puppets, act.match_session.matches, strict=True)
            ],
            strict=True,
        )
    ]
    setups = LiveSetups(
        store,
        [ActorSetup(actor, act.performer, puppet, match) for actor, act, puppet, match in driven],
        clock=clock,
        warn=warn,
    )
    store.versions = Versions(setups.begin())
    store.write()
    return LiveSession(
        store,
        [_staged(*one) for one in driven],
        setups,
        lambda puppet: puppet in matching.puppets,
        tell=tell,
        warn=warn,
    )


def _actor(number: int, puppet: Puppet, name: str, drive: str) -> Actor:
    nodes = len(puppet.character.skeleton.names)
    return Actor(number, puppet.character.name, name, drive, nodes)


def _staged(actor: int, act: Act, puppet: Puppet, match: PuppetMatch) -> StagedActor:
    def seen() -> bool:
        return act.pose is not None and not act.pose.filled.all()

    def performs() -> bool:
        return match.rest is not None and seen()

    def named() -> frozenset[int]:
        return frozenset(node for part in match.parts for node in part.target)

    return StagedActor(
        actor, puppet, seen, performs, named, lambda: [str(part) for part in match.parts]
    )


def _check_actors(path: Path, session: Session, puppets: Sequence[Puppet], drive: str) -> None:
    """Refuse a show whose characters are others than the session's.

    Raises:
        InputError: names, numbers of nodes or the way of driving differ.
    """
    wanted = [actor.name for actor in session.actors]
    given = [puppet.character.name for puppet in puppets]
    if wanted != given:
        raise InputError(
            f"{path} has the characters {', '.join(wanted)}, and the show has {', '.join(given)}: "
            "leave --character out to take those of the session"
        )
    for actor, puppet in zip(session.actors, puppets, strict=True):
        if len(puppet.character.skeleton.names) != actor.nodes:
            raise InputError(
                f"{path} was made with another {actor.name}: it had {actor.nodes} nodes and has "
                f"{len(puppet.character.skeleton.names)} now"
                + (f"; it was driven with --drive {actor.drive}" if actor.drive != drive else "")
            )
