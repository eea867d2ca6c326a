"""Conversation as one seat knows it: utterances of its role, and heard utterances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from dorothie_gym.dialogue.street_titles import NO_TITLES, StreetTitles
from dorothie_gym.lab.console.speech_input import act_json
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.session.spaces.observations import ObservationMapping, heard_acts

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance
    from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove

Entry = dict[str, Any]
"""Line of the talk in JSON types: `t` [s], `who`, `text`; for the role's utterances also `utterance` (number) and
`spans`, for heard ones that name landmarks `places` and `streets` (labels, as they were understood).
"""


class TalkLog:
    """Talk of one seat since the session began.

    Attributes:
        entries: lines in order.
        awaiting: last move that the seat heard, which an answer may follow; None if there is none.

    Args:
        role: role of the seat; None for spectators, who hear all utterances with their acts.
        titles: names of the map for the streets, which the lines have.
    """

    def __init__(self, role: Role | None, titles: StreetTitles = NO_TITLES) -> None:
        self.role, self._titles = role, titles
        self.entries: list[Entry] = []
        self.awaiting: DialogueMove | None = None
        self._read = self._messages = 0

    def hear(self, observation: ObservationMapping) -> None:
        """Appends the content of an observation of the role: utterances of others, and a message of the Ad-Wizard."""
        time = round(float(observation["time"][0]), 1)
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
            text = observation.get(f"{speaker}_text", "")
            if text:
                acts = heard_acts(observation, speaker)
                named = _places_in(acts or (), self._titles)
                self.entries.append({"t": time, "who": speaker.value, "text": self._titles.shown(text), **named})
                self.awaiting = acts[-1].move if acts else None
        if message := observation.get("message", ""):
            self.entries.append({"t": time, "who": Role.AD_WIZARD.value, "text": message})

    def read_own(self, said: Sequence[Utterance], time: float) -> None:
        """Appends the role's own utterances that have ended, and all for spectators.

        Args:
            said: all utterances of the session that have ended.
            time: current time [s].
        """
        for number in range(self._read, len(said)):
            utterance = said[number]
            if self.role is None or utterance.speaker is self.role:
                self.entries.append(own_entry(utterance, number, time, self._titles))
                if self.role is not None:
                    self.awaiting = None
        self._read = len(said)

    def read_messages(self, messages: Sequence[tuple[float, str]]) -> None:
        """Appends the messages of the Ad-Wizard, for its own seat and for spectators: times [s] and texts."""
        for time, text in messages[self._messages :]:
            self.note(Role.AD_WIZARD.value, text, time)
        self._messages = len(messages)

    def note(self, who: str, text: str, time: float) -> None:
        """Appends a message of the experimenter or a note."""
        self.entries.append({"t": round(time, 1), "who": who, "text": text})


def _places_in(acts: Sequence[DialogueAct], titles: StreetTitles) -> Entry:
    """Returns the landmarks and streets that were heard, by their names on the map, if there are landmarks."""
    unknown = (LandmarkName.UNKNOWN, LandmarkName.QUERIED, StreetName.UNKNOWN, StreetName.QUERIED)
    heard = [value for act in acts for value in act.ordered if value not in unknown]
    landmarks = [value.label for value in heard if isinstance(value, LandmarkName)]
    streets = [titles.shown(value.label) for value in heard if isinstance(value, StreetName)]
    return {"places": list(dict.fromkeys(landmarks)), "streets": list(dict.fromkeys(streets))} if landmarks else {}


def own_entry(utterance: Utterance, number: int, time: float, titles: StreetTitles = NO_TITLES) -> Entry:
    """Returns the line of an utterance with its acts."""
    spans = [{"text": titles.shown(span.text), **act_json(span.act)} for span in utterance.spans]
    return {
        "t": round(time, 1),
        "who": utterance.speaker.value,
        "text": titles.shown(utterance.text),
        "utterance": number,
        "spans": spans,
    }
