"""Light programmes in OpenDRIVE files, which the standard leaves to user data: ours have them in their junctions."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.opendrive.own_data import PROGRAMME
from dorothie_gym.maps.town import LightPhase, LightProgramme

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.elements import Element, ElementReader


def read_programmes(reader: ElementReader, root: Element) -> dict[int, LightProgramme]:
    """Returns the programmes of a file by the number of their junction; those that are no programmes are dropped."""
    found = {}
    for junction in root.iterfind("junction"):
        number = reader.junctions.get(junction.get("id", ""))
        for data in junction.iterfind("userData"):
            if number is not None and data.get("code") == PROGRAMME:
                programme = reader.attempt(NoteKind.SIGNAL, partial(_programme, reader, number, data))
                if programme is not None:
                    found[number] = programme
    return found


def _programme(reader: ElementReader, junction: int, data: Element) -> LightProgramme:
    phases = []
    for element in data.iterfind("phase"):
        duration = reader.number(element, "duration")
        if duration <= 0.0:
            reader.fail(element, f"attribute duration must be more than 0 s, but is {duration:g}")
        green, yellow = _signals(reader, element, "green"), _signals(reader, element, "yellow")
        phases.append(LightPhase(duration=duration, green=green, yellow=yellow))
    if not phases:
        reader.fail(data, "is a light programme without phases")
    signals = tuple(sorted({signal for phase in phases for signal in (*phase.green, *phase.yellow)}))
    return LightProgramme(
        junction_id=junction, signals=signals, phases=tuple(phases), offset=reader.number(data, "value", 0.0)
    )


def _signals(reader: ElementReader, phase: Element, colour: str) -> tuple[int, ...]:
    found = []
    for text in (phase.get(colour) or "").split():
        signal = reader.signals.get(text)
        if signal is None:
            reader.fail(phase, f"attribute {colour} refers to signal {text[:20]}, which is not in the file")
        found.append(signal)
    return tuple(found)
