"""Purposes of errands and reasons from the story, as the participant tells them."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies.participant.messages import LONGEST_REASON, refers_back
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.tasks.purposes import Purpose, read_purposes

if TYPE_CHECKING:
    from dorothie_gym.policies.observation_parser import SeenLandmark
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

_SPOKEN_OF = 15.0
"""Time for which "she" refers to the person mentioned last [s]."""


PURPOSES = 0.75
"""Probability that an errand is explained by its purpose rather than by its reason."""


def story_remark(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns the purpose of the target, or its reason, from the story; nothing if the story has neither."""
    told, goal = purpose_of_target(state, view), state.task.goal
    if told is None or goal is None:
        return ()
    options = {
        topic: text
        for topic, text in (("purpose", told.action), ("reason", told.reason))
        if text is not None and len(text) <= LONGEST_REASON
    }
    if told.reason is not None and refers_back(told.reason) and not _has_told_purpose(state, view, goal):
        options.pop("reason", None)  # the antecedent of "she" must be mentioned first
    if goal.name is LandmarkName.PERSON and picks_up(told):
        options.pop("purpose", None)  # it is the order itself: "let's pick up Lin"
    if not options:
        return ()
    prefers = "purpose" if rng.random() < PURPOSES else "reason"
    item = told.items[0] if told.items else None
    for topic in sorted(options, key=lambda name: name != prefers):
        purpose, reason = (options[topic] if topic == name else None for name in ("purpose", "reason"))
        said = Proposition.of(
            Predicate.PURPOSE, place=goal.name, person=told.person, item=item, purpose=purpose, reason=reason
        )
        if said not in state.task.told:
            break
    else:
        return ()  # everything has been stated
    state.task = state.task.after_telling(said)
    return (intend(Function.INFORM, said, elided=("place",), wording=Wording(topic=topic), joined=True),)


def _has_told_purpose(state: ParticipantState, view: ParticipantView, goal: SeenLandmark) -> bool:
    """Returns whether a recent remark has stated the target's purpose, and thereby the person or item in question."""
    if not state.speech.has_just_spoken(view.time, _SPOKEN_OF):
        return False
    recent = (said for item in state.speech.said[-3:] for said in item.meaning)
    purposes = (said for said in recent if said.predicate is Predicate.PURPOSE and said.get("place") is goal.name)
    return any(said.get("purpose") is not None for said in purposes)


def as_afterthought(item: Remark) -> Remark:
    """Returns the wording of a reason after the clause that it explains: "because ..."."""
    if item.wording.topic != "reason":
        return item
    return replace(item, wording=dataclasses.replace(item.wording, topic="reason_after"))


def picks_up(purpose: Purpose | None) -> bool:
    """Returns whether the purpose of an errand is to pick up a person."""
    return purpose is not None and purpose.action is not None and purpose.action.lower().startswith("pick up")


def purpose_of_target(state: ParticipantState, view: ParticipantView) -> Purpose | None:
    """Returns the purpose of the target; None without a target, or if the list does not name it."""
    return None if state.task.target is None else purpose_of(view, state.task.target)


def purpose_of(view: ParticipantView, index: int) -> Purpose | None:
    """Returns the purpose of a subgoal, by its index; None if the list does not name it."""
    live = [subgoal.index for subgoal in view.subgoals if subgoal.live]
    return dict(zip(live, read_purposes(str(view.raw["tasks"])), strict=False)).get(index)
