"""Co-Wizards for talk tasks: the oracle, which weighs the request against the map, and baselines, which do not.

All of them observe what any Co-Wizard observes and act by the same actions. The oracle knows the kinds of requests,
but neither the kind nor the world of its session.
"""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.refusals import agrees, asks, named_places, named_streets, plain
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.policies.observation_parser import SeenLandmark, read_landmarks, read_objects
from dorothie_gym.policies.policy import TypedPolicy, replace
from dorothie_gym.session.spaces.actions import CoWizardAction, LanePosition, Mental, Speech
from dorothie_gym.tasks.catalogue import kinds_in, map_label

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping


class Manner(enum.StrEnum):
    """Manner of a Co-Wizard for talk tasks; the values are names of policies."""

    ORACLE = "talk-oracle"
    """Weighs the request against the map and what is in sight."""
    ALWAYS_ASKS = "always-asks"
    """Asks what is meant, and then does what the words say."""
    NEVER_ASKS = "never-asks"
    """Does what the words say, without a word."""
    SAYS_YES = "says-yes"
    """Promises everything, and then does what the words say."""
    KEYWORDS = "keyword-rule"
    """Asks, declines or drives by words of the request alone."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """Words and deeds of one decision.

    Attributes:
        words: what is said; empty for nothing.
        mark: landmark whose place is marked on the map; None for none.
        goal: place that becomes the goal; None for none.
    """

    words: str = ""
    mark: SeenLandmark | None = None
    goal: LandmarkName | None = None


@dataclass(frozen=True, kw_only=True)
class DriverState:
    """Memory of a driver.

    Attributes:
        town: the map.
        heard: utterances of the client so far.
        steps: what it will do, one step in a decision.
    """

    town: Town
    heard: tuple[str, ...] = ()
    steps: tuple[Step, ...] = ()


class TalkDriver(TypedPolicy[DriverState]):
    """Co-Wizard that reacts to a request in a given manner; the car follows its lane meanwhile."""

    def __init__(self, manner: Manner | str, limits: SpaceLimits | None = None) -> None:
        """Prepares a policy for a manner; the sizes of the spaces default to those of `SpaceLimits`."""
        super().__init__(Role.CO_WIZARD, limits)
        self.manner = Manner(manner)

    def initial_state(self, seed: int, town: Town) -> DriverState:
        """Returns the state before the first decision."""
        return DriverState(town=town)

    def act(self, observation: ObservationMapping, state: DriverState) -> tuple[CoWizardAction, DriverState]:
        """Takes the next step; plans the steps when something is heard."""
        if heard := str(observation["participant_text"]):
            marks = read_landmarks(observation, state.town)
            view = _View(marks=marks, closed=_is_closed(observation))
            state = replace(state, heard=(*state.heard, heard))
            state = replace(state, steps=_PLANS[self.manner](state.heard, view))
        if not state.steps or float(observation["speaking"].item()) > 0.0:
            return CoWizardAction(), state
        step, *later = state.steps
        return _action(step), replace(state, steps=tuple(later))


@dataclass(frozen=True, kw_only=True)
class _View:
    """Knowledge of a driver: the landmarks on its map, and whether something stands on the road ahead."""

    marks: tuple[SeenLandmark, ...]
    closed: bool

    def on_map(self, names: tuple[LandmarkName, ...]) -> tuple[SeenLandmark, ...]:
        return tuple(mark for mark in self.marks if mark.name in names)


_IN_SIGHT: Final = 45.0  # distance of an object that may close the street ahead [m]


def _is_closed(observation: ObservationMapping) -> bool:
    return any(each.prop is not None and each.distance < _IN_SIGHT for each in read_objects(observation))


def _action(step: Step) -> CoWizardAction:
    speech = mental = None
    if step.words:
        move = DialogueMove.QUERY_W if asks(step.words) else DialogueMove.EXPLAIN
        act = DialogueAct.of(move, *named_places(step.words), *named_streets(step.words))
        speech = Speech(act=act, text=step.words)
    if step.mark is not None:
        place = LanePosition(lane=step.mark.lane, metres=round(step.mark.station))
        mental = Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=step.mark.name, place=place)
    if step.goal is not None:
        mental = Mental(action=MentalAction.GOAL_UPDATE, goals=(step.goal,))
    return CoWizardAction(speech=speech, mental=mental)


def _go(mark: SeenLandmark) -> tuple[Step, ...]:
    return Step(mark=mark), Step(goal=mark.name)


# --- What the words say -----------------------------------------------------------------------------------------------

_RESTAURANTS: Final = tuple(kind.name for kind in kinds_in("places.restaurants"))


def _meant(text: str) -> tuple[LandmarkName, ...]:
    """Returns the places that a request may be about."""
    return _RESTAURANTS if "restaurant" in plain(text) else named_places(text)


def _takes(text: str) -> bool:
    return "take me" in plain(text)


def _literally(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    """Does what the words say, whether the map has such a place or not."""
    text = " ".join(heard)
    names = _meant(text)
    if _takes(text) and names:
        streets = named_streets(text)
        there = view.on_map(names)
        fitting = tuple(mark for mark in there if mark.street in streets) or there
        return _go(fitting[0]) if fitting else (Step(goal=names[0]),)
    if asks(heard[0]):
        return (Step(words="Yes, I think so."),)
    return () if _takes(text) else (Step(words="Okay, I will."),)


def _never_asks(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    return _literally(heard, view) if len(heard) == 1 else ()


def _says_yes(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    return (Step(words="Yes, sure, right away."), *_literally(heard, view)) if len(heard) == 1 else ()


def _always_asks(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    if len(heard) == 1:
        return (Step(words="Sorry, which one do you mean, exactly?"),)
    return _literally(heard, view) if len(heard) == 2 else ()


def _keywords(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    text = plain(heard[0])
    if len(heard) == 2:
        return _literally(heard, view)
    if len(heard) > 2:
        return ()
    if any(word in text for word in ("red light", "limit", "wrong side")):
        return (Step(words="I cannot do that, it is against the rules. I can take you another way."),)
    if asks(text):
        return (Step(words="I cannot see that from here. Shall I drive past it?"),)
    if any(word in text for word in ("house", "friend", "person", "restaurant", " or ")) and not named_streets(text):
        return (Step(words="Which one do you mean?"),)
    return _literally(heard, view)


# --- The oracle -------------------------------------------------------------------------------------------------------


def _oracle(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    request = plain(heard[0])
    if _takes(request):
        return _taken(heard, view)
    if asks(request):
        return _answered(request, view)
    if "straight on" in request:
        words = "I cannot drive on, the street is blocked by a barrier ahead. Shall I turn around and go another way?"
        return (Step(words=words if view.closed else "All right, I will."),)
    forbidden = ("not stop at red", "much faster than", "overtake everybody on the wrong")
    if any(each in request for each in forbidden):
        return (Step(words="I cannot do that, it is against the rules. I can take the shortest way instead."),)
    return (Step(words="All right, I will."),) if len(heard) == 1 else ()


def _answered(request: str, view: _View) -> tuple[Step, ...]:
    """Answers a question of which street a place is on; admits that nobody can see anything else."""
    names = named_places(request)
    there = view.on_map(names)
    if "which street" in request or " or on " in request:
        if there:
            return (Step(words=f"It is on {there[0].street.label}."),)
        return (Step(words=_no_such(map_label(names[0]), view)),)
    return (Step(words="I cannot see that from here. I can drive there and look, if you like."),)


def _no_such(label: str, view: _View) -> str:
    other = view.marks[0]
    return f"Sorry, there is no {label} on my map. I can take you to {_called(other)} instead."


def _called(mark: SeenLandmark) -> str:
    return f"{'the ' if mark.name in (LandmarkName.HOUSE, LandmarkName.PERSON) else ''}{map_label(mark.name)}"


def _taken(heard: tuple[str, ...], view: _View) -> tuple[Step, ...]:
    """Reacts to a request for a place, or to a reply about it."""
    request, last = heard[0], heard[-1]
    names = _meant(request) or _meant(" ".join(heard))
    if not names:
        return (Step(words="Where do you want to go?"),) if len(heard) == 1 else ()
    there = view.on_map(names)
    if not there:
        return (Step(words=_no_such(map_label(names[0]), view)),) if len(heard) == 1 else ()
    streets = named_streets(last)
    known = {mark.street for mark in view.marks}
    if len(heard) > 1:
        return _settled(last, there, view)
    fitting = tuple(mark for mark in there if mark.street in streets) if streets else there
    if len(fitting) == 1:
        return _go(fitting[0])
    if not fitting:
        return (Step(words=_contradicted(there[0], streets[0], known)),)
    if len({mark.name for mark in fitting}) > 1:
        return (Step(words=f"Which one do you mean, {' or '.join(_called(mark) for mark in fitting[:3])}?"),)
    where = " or ".join(dict.fromkeys(f"the one on {mark.street.label}" for mark in fitting))
    return (Step(words=f"Which one do you mean, {where}?"),)


def _contradicted(mark: SeenLandmark, said: StreetName, known: set[StreetName]) -> str:
    """Returns what the map says of a place that is said to be elsewhere."""
    if said not in known and mark.name is LandmarkName.HOUSE:
        return f"Sorry, there is no {said.label} on my map. I can take you to the house on {mark.street.label} instead."
    return f"My map shows {_called(mark)} on {mark.street.label} only. Shall I take you there?"


def _settled(last: str, there: tuple[SeenLandmark, ...], view: _View) -> tuple[Step, ...]:
    """Goes to the place that a reply names, or repeats what the map says."""
    streets, names = named_streets(last), named_places(last)
    fitting = tuple(mark for mark in there if mark.name in names) if names else there
    if number := _number_in(last, fitting):
        return _go(fitting[number - 1]) if number <= len(fitting) else ()
    if streets:
        on_street = tuple(mark for mark in fitting if mark.street in streets)
        if not on_street:
            words = f"I am sure too: my map shows {_called(there[0])} on {there[0].street.label}, nowhere else."
            return (Step(words=words),)
        fitting = on_street
    if names or streets or agrees(last) or "take me there" in plain(last):
        return _go(fitting[0]) if fitting else ()
    return ()


def _number_in(text: str, marks: tuple[SeenLandmark, ...]) -> int:
    """Returns the number of the place that a text names as the map does, such as 2 of "House 2"; 0 for none."""
    for label in {map_label(mark.name) for mark in marks}:
        if found := re.search(rf"(?<!\w){re.escape(plain(label))} (\d+)(?!\w)", plain(text)):
            return int(found[1])
    return 0


_PLANS: Final = {
    Manner.ORACLE: _oracle,
    Manner.ALWAYS_ASKS: _always_asks,
    Manner.NEVER_ASKS: _never_asks,
    Manner.SAYS_YES: _says_yes,
    Manner.KEYWORDS: _keywords,
}
