"""Dialogue moves from SDN's logs, with one row for each move of an utterance."""

from __future__ import annotations

import bisect
from collections import defaultdict
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.archive.sdn.files import (
    MORE,
    JsonObject,
    frame_of,
    more_of,
    number_of,
    plain,
    transcript_of,
    whole_of,
)
from dorothie_gym.archive.sdn.slots import LEFT_OUT, SlotReader
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_act, parse_move
from dorothie_gym.session.recording.trajectory import TENTHS

if TYPE_CHECKING:
    from dorothie_gym.archive.sdn.audio import AudioFiles
    from dorothie_gym.session.recording.validation import ReadReport

SDN_WORDS_PER_SECOND: Final = 2.5
"""Speech rate of people, for utterances without a recorded duration [words/s] (spec: design, Time)."""

MAX_SPEECH_GAP: Final = 20
"""Frames (10 Hz) between a stretch of speech and a move that belongs to it."""

MAX_CANDIDATES: Final = 50
"""Latest stretches of one speaker that are candidates for a move."""

_SAMPLE_FIELDS: Final = {"utterance", "act", "slot_type", "slot_val", "is_sog", "is_eog", "is_sot", "is_eot", MORE}
_ACT_FIELDS: Final = {"move", "slots", "exchange", "transaction", "span", "utterance", "start", "end", MORE}


@dataclass(frozen=True)
class Speech:
    """Stretch of speech: speaker, name of the audio file, first and last frame (10 Hz)."""

    speaker: Role
    file: str
    start: int
    end: int


class MoveReader:
    """Turns rows into the data of dialogue moves, in the order of their frames.

    Args:
        speech: the stretches of speech of the session.
        first_frame: frame (10 Hz) at which the session begins.
        report: receives missing, unknown and guessed values.
        audio: the audio files of the session; None for sessions without any, whose data name none.
    """

    def __init__(
        self, speech: Iterable[Speech], first_frame: int, report: ReadReport, *, audio: AudioFiles | None
    ) -> None:
        self._audio = audio
        self._files = {stretch.file: stretch for stretch in speech}
        self._by_speaker: dict[Role, list[Speech]] = defaultdict(list)
        for stretch in sorted(self._files.values(), key=lambda each: (each.start, each.file)):
            self._by_speaker[stretch.speaker].append(stretch)
        self._first = first_frame
        self._report = report
        self._last: tuple[object, ...] | None = None
        self._number = -1
        self._exchange = -1
        self._transaction = -1
        self._open = {"exchange": False, "transaction": False}

    def release(self, row: JsonObject, frame: int, speaker: Role) -> dict[str, object]:
        """Returns the data of a row of the release layout; raises `OntologyError` for an unknown move."""
        given = row.get("act")
        act: JsonObject = given if isinstance(given, Mapping) else {"move": given}
        text = transcript_of(row.get("utterance_gt"), self._report)
        recognised = transcript_of(row.get("utterance"), self._report)
        if text is None:
            self._report.miss("utterance_gt (the recogniser's transcript stands in for it)")
            text = recognised or ""
        slots = SlotReader(self._report)
        slots.read(act.get("slots"))
        data = self._said(row, act, slots, frame, speaker, text)
        if recognised is not None:
            data["recognised"] = recognised
        else:
            self._report.miss("utterance (the recogniser's transcript)")
        if (transaction := whole_of(act.get("transaction"))) is not None:
            data["transaction"] = transaction
        self._keep_rest(data, act, _ACT_FIELDS)
        return data

    def sample(self, row: JsonObject, val: JsonObject, frame: int, speaker: Role) -> dict[str, object]:
        """Returns the data of a row of the sample layout, which marks the ends of exchanges and transactions."""
        for name, mark in (("exchange", "g"), ("transaction", "t")):
            if val.get(f"is_so{mark}") is True:
                self._open[name] = True
                setattr(self, f"_{name}", getattr(self, f"_{name}") + 1)
        text = transcript_of(val.get("utterance"), self._report) or ""
        slots = SlotReader(self._report)
        slots.read_pair(val.get("slot_type"), val.get("slot_val"))
        data = self._said(row, {"move": val.get("act")}, slots, frame, speaker, text)
        data["exchange"] = self._exchange if self._open["exchange"] else None
        if self._open["transaction"]:
            data["transaction"] = self._transaction
        for name, mark in (("exchange", "g"), ("transaction", "t")):
            if val.get(f"is_eo{mark}") is True:
                self._open[name] = False
        self._keep_rest(data, val, _SAMPLE_FIELDS)
        return data

    def _keep_rest(self, data: dict[str, object], act: JsonObject, known: Container[str]) -> None:
        """Keeps and reports the unknown fields of an act."""
        rest = {str(plain(name)): plain(value) for name, value in act.items() if name not in known}
        for name in rest:
            self._report.keep(f"act: field {name!r}")
        kept = data.get("sdn_act")
        if rest:
            data["sdn_act"] = {**rest, **(kept if isinstance(kept, dict) else {})}

    def _said(
        self, row: JsonObject, act: JsonObject, slots: SlotReader, frame: int, speaker: Role, text: str
    ) -> dict[str, object]:
        parsed = parse_act(_move_of(act.get("move")).label, slots.found)
        stretch = self._stretch(row, frame, speaker)
        file = stretch.file if stretch is not None else None
        given = whole_of(act.get("utterance"))
        same = (speaker, given) if given is not None else (speaker, text, frame if file is None else file)
        if same != self._last:
            self._number += 1
            self._last = same
        recorded = None if stretch is not None else self._recorded(row, frame)
        start, end = self._times(act, stretch, frame, text, recorded)
        span = transcript_of(act.get("span"), self._report)
        data: dict[str, object] = {
            "utterance": self._number,
            "text": str(plain(text)),
            "span": str(plain(text if span is None else span)),
            "move": parsed.move.label,
            "slots": parsed.slot_labels(),
            "exchange": whole_of(act.get("exchange")),
            "start": start,
            "end": end,
        }
        if recorded is not None:
            file = recorded[0]
        if file is not None and self._audio is not None:
            data["audio"] = str(plain(file))
        if slots.left:
            data["sdn_act"] = {LEFT_OUT: plain(slots.left)}
        return {**data, **more_of(act)}

    def _stretch(self, row: JsonObject, frame: int, speaker: Role) -> Speech | None:
        file = row.get("utterance_filename")
        if isinstance(file, str) and file in self._files:
            return self._files[file]
        own = self._by_speaker[speaker]
        begun = bisect.bisect_right(own, frame + MAX_SPEECH_GAP, key=lambda stretch: stretch.start)
        near = [
            (max(stretch.start - frame, frame - stretch.end, 0), -stretch.start, stretch.file)
            for stretch in own[max(begun - MAX_CANDIDATES, 0) : begun]
        ]
        best = min(near, default=None)
        return self._files[best[2]] if best is not None and best[0] <= MAX_SPEECH_GAP else None

    def _recorded(self, row: JsonObject, frame: int) -> tuple[str, float] | None:
        """Returns name and duration of the audio file of a row without a stretch of speech."""
        name = row.get("utterance_filename")
        return None if self._audio is None else self._audio.find(name if isinstance(name, str) else None, frame)

    def _times(
        self, act: JsonObject, stretch: Speech | None, frame: int, text: str, recorded: tuple[str, float] | None
    ) -> tuple[float, float]:
        """Returns start and end of an utterance [s], neither before the session; the frame of a row is the end."""
        start, end = number_of(act.get("start")), number_of(act.get("end"))
        if start is not None and end is not None:
            return start, end
        if stretch is not None:
            begun = max(stretch.start - self._first, 0)
            return begun / TENTHS, max(stretch.end - self._first, begun) / TENTHS
        over = max(frame - self._first, 0) / TENTHS
        if recorded is None:
            self._report.repair("times of utterances without audio were guessed from their words")
        length = max(len(text.split()), 1) / SDN_WORDS_PER_SECOND if recorded is None else recorded[1]
        return max(round(over - length, 3), 0.0), over


def read_speech(
    rows: Iterable[JsonObject], report: ReadReport, speaker_of: Callable[[JsonObject], Role | None]
) -> tuple[Speech, ...]:
    """Returns the stretches of speech; the log has a row for every frame of each."""
    found: dict[str, Speech] = {}
    for row in rows:
        file, frame = row.get("utterance_filename"), frame_of(row)
        speaker = speaker_of(row)
        if not isinstance(file, str) or frame is None or speaker is None:
            report.repair("rows of speech without frame, speaker or file were left out")
            continue
        start, end = whole_of(row.get("start_frame")), whole_of(row.get("end_frame"))
        before = found.get(file, Speech(speaker, file, frame, frame))
        found[file] = Speech(
            before.speaker,
            file,
            min(before.start, frame if start is None else start),
            max(before.end, frame if end is None else end),
        )
    return tuple(sorted(found.values(), key=lambda stretch: (stretch.start, stretch.file)))


def _move_of(value: object) -> DialogueMove:
    """Returns the move for a name or for its number in SDN; raises `OntologyError` for unknown ones."""
    number = None if isinstance(value, str | bool) else whole_of(value)
    if number is not None and number in DialogueMove._value2member_map_:
        return DialogueMove(number)
    return parse_move(str(value))
