"""The parts of a running show that a puppeteer's actions change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from replay.playback import Playback
from runtime.conditioning.switches import Conditioning
from runtime.control.by_hand.chooser import Chooser
from runtime.control.count_in import CountIn
from runtime.puppet.puppet import Puppet
from runtime.session.live_session import LiveSession
from runtime.show.act_group import ActGroup
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from runtime.show.takes import Takes
from runtime.status.notices import Notices, SecondPress


@dataclass(slots=True)
class View:
    """What the window shows besides the picture; outputs never show it.

    Attributes:
        panel: whether the panel is shown.
        sliders: whether the column of sliders and switches is shown beside the panel.
        help: whether the list of all keys is shown.
        full_screen: whether the window fills the screen.
        audience: whether a second window shows the show alone.
    """

    panel: bool = True
    sliders: bool = False
    help: bool = False
    full_screen: bool = False
    audience: bool = False


@dataclass(slots=True, eq=False)
class ShowControls:
    """The parts of a show that actions change.

    Attributes:
        match_controls: matching, of all acts.
        conditioning: the switches of the conditioning.
        loop: the frame loop, which freezes the characters.
        puppets: all characters as they are driven.
        takes: the recorder of takes.
        notices: what happened last.
        chooser: lets pairs be chosen by hand.
        count_in: counts seconds down before a take.
        playback: the playback of a recording; None where the stream is live.
        session: the session that is open; None for none.
        scene: the picture; None where no picture is drawn.
        view: what the window shows besides the picture.
        leaving: whether the show is to end.
        leave_asked: notes that it was asked to end while something is recorded.
    """

    match_controls: ActGroup
    conditioning: Conditioning
    loop: FrameLoop
    puppets: Sequence[Puppet]
    takes: Takes
    notices: Notices
    chooser: Chooser
    leave_asked: SecondPress
    count_in: CountIn
    playback: Playback | None = None
    session: LiveSession | None = None
    scene: Scene | None = None
    view: View = field(default_factory=View)
    leaving: bool = False

    @property
    def selected(self) -> Sequence[Puppet]:
        """The characters that actions are for."""
        return self.match_controls.puppets

    def select(self, number: int | None) -> None:
        """Select one character, from 0, for the actions that follow, or all."""
        self.match_controls.select(number)
        if self.scene is not None:
            self.scene.focus = number or 0
