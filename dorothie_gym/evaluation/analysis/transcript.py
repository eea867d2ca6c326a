"""Transcript of a session: utterances with their annotation, and the events between them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Final

from dorothie_gym.evaluation.analysis.exception_attribution import Handled, handling
from dorothie_gym.evaluation.analysis.phenomena.catalogue import PHENOMENA
from dorothie_gym.evaluation.analysis.phenomena.dialogue_view import DialogueView
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.recording.events import INFRACTIONS, Event, EventType, UtteranceRecord, action_record
from dorothie_gym.session.recording.street_titles import recorded_titles

if TYPE_CHECKING:
    from dorothie_gym.dialogue.street_titles import StreetTitles
    from dorothie_gym.session.recording.session import Session

NAMES: Final[Mapping[Role, str]] = {
    Role.PARTICIPANT: "Participant",
    Role.CO_WIZARD: "Co-Wizard",
    Role.AD_WIZARD: "Ad-Wizard",
    Role.AGENT: "Car",
}

_HANDLED: Final = {Handled.ENVIRONMENTAL: " (env)", Handled.TASK: " (task)", Handled.NONE: ""}
_MENTAL: Final = {action.label: action.label for action in MentalAction if action is not MentalAction.PLAN_UPDATE}
_HEAD: Final = ("begins", "speaker", "words [acts] or event", "exchange", "transaction")


@dataclass(frozen=True, kw_only=True)
class TranscriptLine:
    """Line of a transcript.

    Attributes:
        time: start of the line [s].
        speaker: role of the line.
        text: words with the act of each span after it; for other events, a description.
        said: whether it is an utterance.
        exchanges: number of each of its exchanges, and the kind of exception that the exchange handles, if any.
        transaction: number of its transaction; empty without one.
    """

    time: float
    speaker: Role
    text: str
    said: bool
    exchanges: str = ""
    transaction: str = ""


def transcript_lines(session: Session) -> tuple[TranscriptLine, ...]:
    """Returns the lines of a session in order of their starts; streets have the names of the map, if it names them.

    Exchanges and transactions are those that the rules derive. Actions of the car between two utterances share a line.
    """
    units = Units(session)
    kinds = handling(units)
    titles = recorded_titles(session.header)
    said = [_said(utterance, units, kinds, titles) for utterance in units.utterances]
    happened = [line for event in session.events for line in _happened(event, session)]
    ordered = sorted([*said, *happened], key=lambda line: line.time)
    return tuple(_together(ordered))


def markdown(session: Session, title: str | None = None) -> str:
    """Returns a session as a section of a Markdown page.

    Args:
        session: a session of any layout.
        title: heading of the section; None for the session's name.
    """
    head = [f"## {title or session.name}", "", *_facts(session), ""]
    rows = [" | ".join(_HEAD), " | ".join("---" for _ in _HEAD)]
    for line in transcript_lines(session):
        words = _escaped(line.text) if line.said else f"*{_escaped(line.text)}*"
        rows.append(f"{line.time:.1f} | {NAMES[line.speaker]} | {words} | {line.exchanges} | {line.transaction}")
    return "\n".join([*head, *(f"| {row} |" for row in rows)]) + "\n"


# --- Head ------------------------------------------------------------------------------------------------------------


def _facts(session: Session) -> Iterator[str]:
    header = session.header
    yield f"- Town {header.town}, storyboard {header.storyboard or '-'}, seed {header.seed}, {session.duration:.0f} s."
    if header.story:
        yield f"- Story: {_escaped(header.story)}"
    for number, subgoal in enumerate(header.subgoals):
        place = header.landmarks[subgoal["landmark"]]
        hidden = ", hidden from the car" if place["hidden"] else ""
        yield f"- Errand {number}: {_escaped(subgoal['description'])} ({place['name']}{hidden})"
    if session.summary:
        ended = "success" if session.summary.get("success") else "no success"
        yield f"- Ended with {ended} ({session.summary.get('reason', '-')})."
    talk = DialogueView(session)
    found = Counter({each.number: sum(1 for _ in each.find(talk)) for each in PHENOMENA if each.has_cause(talk)})
    shown = ", ".join(f"{number} ({count})" for number, count in sorted(found.items()) if count)
    yield f"- Phenomena (count): {shown or '-'}."


# --- Lines -----------------------------------------------------------------------------------------------------------


def _said(
    utterance: UtteranceRecord, units: Units, kinds: Mapping[int, Handled], titles: StreetTitles
) -> TranscriptLine:
    numbers = [units.exchange_of(move) for move in utterance.moves]
    known = list(dict.fromkeys(number for number in numbers if number is not None))
    transaction = units.transaction_of(utterance.moves[0])
    text = " ".join(f"{move.span} [{str(move.act).removesuffix('()')}]" for move in utterance.moves)
    heard = utterance.moves[0].recognised
    if heard is not None and heard != utterance.text:
        text += f' (heard: "{heard}")'
    if any(str(units.session.events[move.index].data.get("audio")) in units.session.audio for move in utterance.moves):
        text += f" (audio {utterance.number})"
    return TranscriptLine(
        time=utterance.start,
        speaker=utterance.speaker,
        text=titles.shown(text),
        said=True,
        exchanges=", ".join(f"{number}{_HANDLED[kinds[number]]}" for number in known),
        transaction="" if transaction is None else str(transaction),
    )


def _happened(event: Event, session: Session) -> Iterator[TranscriptLine]:
    text = description_of(event, session)
    if text:
        yield TranscriptLine(time=event.time, speaker=event.source, text=text, said=False)


def description_of(event: Event, session: Session) -> str:
    """Returns the description of an event other than a dialogue move; empty for events that transcripts leave out."""
    data = event.data
    if event.type is EventType.PHYSICAL_ACTION:
        return _action_text(event)
    if event.type is EventType.BELIEF_UPDATE and data.get("action") in _MENTAL:
        about = data.get("landmarks", data.get("landmark"))
        names = about if isinstance(about, Sequence) and not isinstance(about, str) else [about]
        status = f" {data['status']}" if "status" in data else ""
        return f"{data['action']}({', '.join(str(name) for name in names if name is not None)}{status})"
    if event.type is EventType.EXCEPTION:
        more = ", ".join(
            f"{k} {_number(v)}" for k, v in data.items() if k != "kind" and isinstance(v, str | int | float)
        )
        return f"{str(data.get('kind')).replace('_', ' ')}: {more}"
    if event.type is EventType.MESSAGE:
        return f"message: “{data.get('text')}”"
    if event.type is EventType.SUBGOAL:
        return f"errand {data.get('subgoal')} ({data.get('landmark')}) is {data.get('status')}"
    if event.type is EventType.HAZARD_STOP:
        return f"brakes for {data.get('reason')}"
    if event.type in INFRACTIONS:
        return event.type_name
    return f"the session is over: {data.get('reason')}" if event.type is EventType.END else ""


def _action_text(event: Event) -> str:
    action = action_record(event, 0, "event")
    text = action.action.label
    if action.angle is not None:
        text += (
            f" {abs(action.angle):.0f}° {'left' if action.angle > 0 else 'right'}" if action.angle else " straight on"
        )
    elif action.up is not None:
        text += " up" if action.up else " down"
    return text


def _together(lines: Iterable[TranscriptLine]) -> Iterator[TranscriptLine]:
    """Joins neighbouring lines of one role that are not utterances; repetitions are counted."""
    for (said, speaker), group in groupby(lines, key=lambda line: (line.said, line.speaker)):
        same = list(group)
        if said:
            yield from same
            continue
        texts = [(text, sum(1 for _ in again)) for text, again in groupby(line.text for line in same)]
        text = "; ".join(text if count == 1 else f"{text} ({count} times)" for text, count in texts)
        yield TranscriptLine(time=same[0].time, speaker=speaker, text=text, said=False)


def _escaped(text: object) -> str:
    """Returns a text escaped for a Markdown table."""
    clean = " ".join(str(text).split())
    for letter in "\\|*_<>`":
        clean = clean.replace(letter, f"\\{letter}")
    return clean


def _number(value: str | float) -> str:
    """Returns a value of an event; numbers with one decimal at most."""
    return f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else str(value)
