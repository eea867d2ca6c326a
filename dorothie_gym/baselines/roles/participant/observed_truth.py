"""Statements about the surroundings that contradict the learned participant's observation and are not made."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies.notable_conditions import CONSPICUOUS, CROWD_DISTANCE, CROWDS, OVER
from dorothie_gym.policies.observation_parser import weather

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.policies.speech import Remark


def is_denied(remark: Remark, view: ParticipantView) -> bool:
    """Returns whether a remark mentions a crowd or weather that is not observed.

    The thresholds are those of the scripted speakers.
    """
    states = remark.act.move is DialogueMove.EXPLAIN
    return states and any(_is_wrong(said, view) for said in remark.meaning)


def _is_wrong(said: Proposition, view: ParticipantView) -> bool:
    if said.predicate is Predicate.CROWDED:
        kind = next((one for one in CROWDS if one is said.get("object")), None)
        if kind is None:
            return False
        near = sum(thing.kind is kind and thing.distance < CROWD_DISTANCE for thing in view.objects)
        return (near < CROWDS[kind]) is not said.negated
    parameter = said.get("parameter")
    if said.predicate is Predicate.WEATHER and isinstance(parameter, WeatherParameter):
        conspicuous = CONSPICUOUS[parameter]({each: weather(view.raw, each) for each in WeatherParameter})
        return conspicuous < 1.0 if said.get("high") else conspicuous >= OVER
    return False
