"""Opens what a show writes: its outputs, its takes, its recording, and its report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from devices.errors import InputError
from devices.stream import SkeletonStream
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.characters.character import Character
from runtime.output.files.export import OF_NODES
from runtime.output.files.kept_file import Kept, KeptFile, size_of
from runtime.output.output import Output
from runtime.output.report.report import CharacterReport, Report
from runtime.puppet.puppet import Puppet
from runtime.show.outputs import open_outputs
from runtime.show.pacing import loses_no_frame
from runtime.show.provenance import provenance
from runtime.show.settings import ShowSettings
from runtime.show.takes import Takes, set_aside
from runtime.status.notices import Notices


class Written:
    """The files and senders of a show; `closing` finishes them.

    Args:
        settings: of the show.
        stream: what the show polls.
        source: the stream below it, as it was opened.
        origin: what the show plays, in words, for recordings of it.
        closing: closes what was opened.
        notices: told when takes begin and end, and of faults.
        clock: host monotonic time [s].

    Attributes:
        report: the figures of the show.
        takes: takes that may be started, once they are open.
    """

    def __init__(
        self,
        settings: ShowSettings,
        stream: RecordedStream,
        source: SkeletonStream,
        origin: str,
        closing: ExitStack,
        *,
        notices: Notices,
        clock: Callable[[], float],
    ) -> None:
        self._settings, self._closing, self._clock = settings, closing, clock
        self._stream, self._source, self._origin = stream, source, origin
        self._notices = notices
        self._outputs: list[list[Output]] = []
        self._kept_report: list[Kept] = []
        self._in_session = False
        self.report = Report(settings.files.report)
        self.takes: Takes | None = None

    @property
    def kept(self) -> list[Kept]:
        """What lies where the show wrote files, once it is closed."""
        outputs = [output for own in self._outputs for output in own]
        files = [output.kept for output in outputs if isinstance(output, KeptFile)]
        takes = [] if self.takes is None else self.takes.kept
        if self._in_session:  # which holds those that are whole, and tells of them itself
            takes = [kept for kept in takes if kept.fault]
        return [*files, *takes, *self._kept_report]

    def check_export(self, puppets: Sequence[Puppet]) -> None:
        """Refuse to export nodes that no driver poses, before a file is touched.

        Raises:
            InputError: a driver poses no nodes, and the export needs them.
        """
        export = self._settings.files.export
        if export is None or export.suffix.lower() not in OF_NODES:
            return
        for puppet in puppets:
            if puppet.driver is not None and not puppet.driver.poses_nodes:
                raise InputError(
                    f"cannot export {export}: the driver of {puppet.character.name} poses no "
                    "nodes; export a .usdc, which holds the surface, or choose another driver"
                )

    def open_outputs(
        self,
        characters: Sequence[tuple[Character, CharacterReport]],
        own: Sequence[Output],
        rate: float,
    ) -> list[list[Output]]:
        """Open the outputs of each character; the report is written after all are closed.

        Args:
            characters: with the part of the report that is theirs.
            own: further outputs, of the first character.
            rate: about how many frames come in a second.

        Raises:
            InputError: an output cannot be opened.
        """
        self._closing.callback(self._keep_report)
        self._outputs = open_outputs(
            self._settings,
            characters,
            self._stream.skeleton,
            rate,
            self._closing,
            warn=self._notices.warn,
        )
        self._outputs[0].extend(self._closing.enter_context(output) for output in own)
        return self._outputs

    def open_takes(self, folder: Path | None = None) -> Takes:
        """Open takes that may be started, and the recording of the whole show if it was asked for.

        Args:
            folder: where takes are written; None for where the settings say.

        Raises:
            InputError: the recording cannot be opened.
        """
        files = self._settings.files
        usual = files.takes or files.record or Path("take.mcap")
        self._in_session = folder is not None
        recorder = None
        if files.record is not None:
            set_aside(files.record, self._notices.warn)
            recorder = self._open_recorder(files.record)
            self._closing.callback(self.report.kept, recorder)  # once it is closed
        self.takes = Takes(
            self._stream,
            usual if folder is None else folder / usual.name,
            self._open_recorder,
            tell=self._notices.tell if folder is None else lambda _: None,  # a session tells it
            warn=self._notices.warn,
            whole=recorder,
            waits=loses_no_frame(self._source),
            clock=self._clock,
        )
        return self._closing.enter_context(self.takes)

    def _open_recorder(self, path: Path) -> Recorder:
        source = provenance(self._origin)
        return Recorder(path, self._stream.skeleton, source=source, tell=self._notices.warn)

    def _keep_report(self) -> None:
        path = self._settings.files.report
        if path is None:
            return
        try:
            self.report.close()
        except InputError as error:
            self._notices.warn(str(error))
            self._kept_report.append(Kept(path, "not written", str(error)))
        else:
            self._kept_report.append(Kept(path, size_of(path)))
