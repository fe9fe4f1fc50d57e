"""The actions on the way to a take: a match is used, a count-in goes by, a take begins and ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from runtime.control.action import Action, switch
from runtime.control.count_in import MOST, Counted
from runtime.control.show_controls import ShowControls
from runtime.session.session_takes import begin_take, end_take


def is_matching(controls: ShowControls) -> bool:
    """Whether a match is looked for."""
    return controls.match_controls.matching


def is_recording(controls: ShowControls) -> bool:
    """Whether a take is recorded, or counted in."""
    if controls.count_in.counted is Counted.TAKE:
        return True
    if controls.session is not None:
        return controls.session.recording
    return controls.takes.recording


def record(controls: ShowControls, on: bool) -> None:
    """Begin a take after the count-in, or end it; a count-in is ended without a take."""
    if not on:
        if not end_count_in(controls):
            _end_take(controls)
    elif not is_recording(controls) and (controls.session is None or controls.session.stand_by()):
        end_count_in(controls)
        takes = controls.takes
        if controls.count_in.seconds > 0.0:
            controls.count_in.begin(
                Counted.TAKE, lambda: _begin_take(controls, takes.start_with_newest)
            )
        else:
            _begin_take(controls, takes.start)


def end_count_in(controls: ShowControls) -> bool:
    """End a count-in before zero, and say so; return whether there was one."""
    if not controls.count_in.end():
        return False
    controls.match_controls.wait(False)
    controls.notices.show("the countdown has ended: nothing begins")
    return True


def _begin_take(controls: ShowControls, start: Callable[[], None]) -> None:
    if controls.session is not None:
        begin_take(controls.session, controls.takes, start)
    else:
        start()


def _end_take(controls: ShowControls) -> None:
    if controls.session is not None:
        end_take(controls.session, controls.takes)
    else:
        controls.takes.stop()


def _accept(controls: ShowControls) -> None:
    if controls.chooser.on:
        controls.chooser.accept()
        return
    if not is_matching(controls):
        controls.notices.show("no match is looked for: m looks for one")
        return
    if controls.count_in.counted is Counted.REST:
        return
    end_count_in(controls)
    if controls.count_in.seconds > 0.0:
        controls.match_controls.wait(True)  # for the end of the count-in
        controls.count_in.begin(Counted.REST, lambda: _take_rest(controls))
    else:
        _take_rest(controls)


def _take_rest(controls: ShowControls) -> None:
    controls.match_controls.wait(False)
    controls.match_controls.accept()
    if is_matching(controls):
        controls.notices.show("no pose has been seen yet: step into view")
    else:
        controls.notices.show("this match performs now")


def leave(controls: ShowControls) -> None:
    """Leave; while something is recorded, only when asked twice.

    While pairs are chosen by hand or a count-in goes by, leave only that.
    """
    if controls.chooser.on:
        controls.chooser.leave()
        controls.notices.show("what drove goes on")
        return
    if end_count_in(controls):
        return
    running = controls.takes.running
    if running and not controls.leave_asked.again():
        names = ", ".join(take.path.name for take in running)
        controls.notices.show(f"{names} is being recorded: press again to end it and leave")
        return
    controls.leaving = True


def _set_length(controls: ShowControls, share: float) -> None:
    controls.count_in.seconds = float(round(share * MOST))


def count_in_words(controls: ShowControls) -> str:
    """How long the count-in is."""
    seconds = controls.count_in.seconds
    return f"Count-in: {seconds:g} s" if seconds else "Count-in: none"


ACCEPT = Action(
    "Use this match",
    "use the match that lights up, with your present pose as rest pose",
    press=_accept,
)
TAKE_ACTIONS: Mapping[str, Action] = {
    "record": switch(
        "Record",
        "begin or end a take",
        is_recording,
        record,
        done=("", ""),
    ),
    "count-in": Action(
        "Count-in",
        "how many seconds are counted before a take, and before an accepted match performs",
        write=_set_length,
        read=lambda controls: min(controls.count_in.seconds / MOST, 1.0),
    ),
    "next-count-in": Action(
        "Count-in length",
        "count 0, 3, 5 or 10 seconds before a take",
        press=lambda controls: controls.count_in.lengthen(),
        words=count_in_words,
    ),
}
"""The rows of the table of actions that lead to a take."""
