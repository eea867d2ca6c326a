"""The scripted Co-Wizard as a teacher: run alongside a session, it reports its choices of actions, memory and remarks.

The teacher has the player's observations. The player's actions and remarks are copied into its state instead of its own
(`drove`, `talked`), so that it continues from the player's situation, not from its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.baselines.roles.co_wizard.answers import QUESTIONS
from dorothie_gym.baselines.roles.co_wizard.memory import (
    FRESH,
    ORDERS,
    STATUSES,
    VARIABLES,
    GoalEvent,
    Update,
    speed_index,
)
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import new_remarks
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.co_wizard.driving import drive, end_red_light_rest, rest
from dorothie_gym.policies.co_wizard.intentions import Directive, Wish
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard, attend, respond
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, SpeechState
from dorothie_gym.session.spaces.actions import CoWizardAction, Physical

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.state import CoWizardState, DialogueState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

CALM = CoWizardStyle(
    echoes=0.3, checks=0.1, announces=0.0, silent=0.4, asks=0.6, proposes=0.0, mishears=0.0, careful=1.0, notices=0.9
)
"""Style of the teacher while the player plays: it understands all utterances, and makes no random choices."""

_WISHES = (None, Wish.U_TURN, Wish.SWITCH_LEFT, Wish.SWITCH_RIGHT)


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """Decision of the teacher.

    Attributes:
        update: its memory after listening and looking.
        physical: its physical action.
        remarks: remarks that it chooses now, for this utterance or the next.
        queued: whether remarks were waiting to be said before.
        ready: whether it has reacted to the last utterance; before, it gives no commands.
        action: the whole action.
    """

    update: Update
    physical: Physical | None
    remarks: tuple[Remark, ...]
    queued: bool
    ready: bool
    action: CoWizardAction


class Teacher:
    """Scripted Co-Wizard that runs alongside a session."""

    def __init__(self, town: Town, limits: SpaceLimits, seed: int, style: CoWizardStyle | None = None) -> None:
        """Prepares the teacher.

        Args:
            town: the map.
            limits: sizes of the spaces.
            seed: seed of its draws, that of the recorded policy where a recorded session is followed.
            style: style; None for the persona of the seed.
        """
        self._state = ScriptedCoWizard(limits, style).initial_state(seed, town)
        self._former = self._state
        self._physical: Physical | None = None
        self._intentions, self._commands = self._state.intentions, self._state.commands
        self._dialogue = self._state.dialogue

    @property
    def usual_speed(self) -> int:
        """Default cruise speed [km/h]."""
        return self._state.intentions.usual

    @property
    def speech(self) -> SpeechState:
        """Remarks that were said, and queued ones."""
        return self._state.speech

    def decide(
        self, observation: ObservationMapping, named: Sequence[LandmarkName], streets: Sequence[StreetName]
    ) -> Lesson:
        """Takes a decision.

        Args:
            observation: observation of the Co-Wizard.
            named: places named in the utterance just heard.
            streets: streets named in it.
        """
        former = self._state
        decision = attend(observation, former)
        state, view = decision.state, decision.view
        rest(state, view, decision.rng)
        end_red_light_rest(state, view)
        update = _update(former, state, view, named, streets)
        self._former, self._intentions, self._commands = former, state.intentions, state.commands
        self._dialogue = state.dialogue
        heard = new_remarks(former.speech.queue, state.speech.queue)
        physical = drive(state, view)
        waiting = state.speech.queue
        action = respond(decision, physical)
        after = (*state.speech.said[-1:], *state.speech.queue) if action.speech is not None else state.speech.queue
        own = () if waiting else new_remarks((), after)
        self._state, self._physical = state, physical
        return Lesson(
            update=update,
            physical=physical,
            remarks=(*heard, *own),
            queued=bool(former.speech.queue),
            action=action,
            ready=view.time >= state.commands.ready_at,
        )

    def drove(self, physical: Physical | None) -> None:
        """Puts the physical action of the player into the state."""
        state = self._state
        if physical != self._physical:
            state.intentions, state.commands = self._intentions, self._commands

    def talked(self, voice: SpeechState, remarks: Sequence[Remark], lesson: Lesson, view: CoWizardView) -> None:
        """Copies the player's remarks into the state, in place of the teacher's.

        Topics that the teacher has chosen to mention count as mentioned, but its questions do not count as asked; the
        player's do.

        Args:
            voice: remarks of the player, queued and said.
            remarks: remarks that the player has just chosen.
            lesson: decision of the teacher.
            view: observation.
        """
        state, before = self._state, self._dialogue
        state.speech = replace(voice, queue=())
        if any(remark.act.move in QUESTIONS for remark in lesson.remarks):
            state.dialogue = replace(
                state.dialogue, asked_at=before.asked_at, asked_lane=before.asked_lane, proposed=before.proposed
            )
        for remark in remarks:
            if remark.act.move in QUESTIONS:
                state.dialogue = _asking(state.dialogue, remark, view)


def _asking(dialogue: DialogueState, remark: Remark, view: CoWizardView) -> DialogueState:
    """Returns the course of the dialogue after a question of the player."""
    asks_way = any(said.predicate is Predicate.WILL for said in remark.meaning)
    if not asks_way or view.choice is None:
        return dialogue.after_asking(view.time)
    direction = remark.meaning[0].get("direction")
    proposed = None
    if isinstance(direction, Direction):
        proposed = Directive(direction=direction, junction=view.choice.junction)
    return dialogue.after_asking_way(view.choice.lane, view.time).with_proposal(proposed)


def _update(
    former: CoWizardState,
    state: CoWizardState,
    view: CoWizardView,
    named: Sequence[LandmarkName],
    streets: Sequence[StreetName],
) -> Update:
    intentions, before, dialogue = state.intentions, former.intentions, state.dialogue
    directive, known = intentions.directive, before.directive
    order = 0
    if directive is not None:
        order = ORDERS.index("street" if directive.direction is None else directive.direction)
    proposed = None if dialogue.proposed is None else dialogue.proposed.direction
    values = {
        "order": order,
        "onto_street": int(directive is not None and directive.street is not StreetName.UNKNOWN),
        "skip": 0 if directive is None else min(directive.skip, 3),
        "manoeuvre": _WISHES.index(intentions.wish),
        "halted": int(intentions.halted),
        "arrived": int(intentions.arrived),
        "creeping": int(intentions.creeping),
        "pausing": int(intentions.pausing),
        "nudging": int(intentions.nudge is not None),
        "resting": int(view.time < state.commands.rest_until),
        "speed": speed_index(intentions.speed),
        "lights": 0 if intentions.lights is None else 1 if intentions.lights else 2,
        "proposed": ORDERS.index(proposed) if isinstance(proposed, Direction) else 0,
        "offering": int(dialogue.offer is not None),
        "detour": int(dialogue.detour_asked_at is not None),
        "slower": int(dialogue.slower is not None),
    }
    heard = bool(dialogue.heard_at >= view.time)
    taken = directive is not None and directive is not known
    fresh = {
        "order": taken and (known is None or heard) and not _counted_down(known, directive),
        "nudging": intentions.nudge is not None and intentions.nudge is not before.nudge,
        "creeping": heard and intentions.creeping and state.beliefs.place != former.beliefs.place,
    }
    return Update(
        values=tuple(values[name] for name in VARIABLES),
        fresh=tuple(bool(fresh[name]) for name in FRESH),
        goal=_goal_event(former, state, view, named),
        status=_status(former, state, named),
    )


def _counted_down(known: object, directive: object) -> bool:
    skips = getattr(known, "skip", None), getattr(directive, "skip", None)
    same = getattr(known, "direction", 0) is getattr(directive, "direction", 1)
    return same and skips[0] is not None and skips[1] is not None and skips[1] == skips[0] - 1


def _goal_event(former: CoWizardState, state: CoWizardState, view: CoWizardView, named: Sequence[LandmarkName]) -> int:
    old, new = former.beliefs, state.beliefs
    if new.goal is None:
        return GoalEvent.KEEP if old.goal is None else GoalEvent.CLEAR
    if new.exact and new.place is not None:
        if old.exact and (old.goal, old.place) == (new.goal, new.place):
            return GoalEvent.KEEP
        row = next((mark.row for mark in view.landmarks if mark.place == new.place and mark.name is new.goal), None)
        return GoalEvent.KEEP if row is None else len(GoalEvent) + row
    if old.goal is new.goal:
        return GoalEvent.DOUBT if old.exact else GoalEvent.KEEP
    which = list(named).index(new.goal) if new.goal in named else 0
    return GoalEvent.OFF_MAP_SECOND if which else GoalEvent.OFF_MAP_FIRST


def _status(former: CoWizardState, state: CoWizardState, named: Sequence[LandmarkName]) -> int:
    place = next(iter(named), former.beliefs.goal)
    new = dict(state.beliefs.statuses).get(place) if place is not None else None
    old = dict(former.beliefs.statuses).get(place) if place is not None else None
    return STATUSES.index(new) if new is not old and new in STATUSES and isinstance(new, GoalStatus) else 0
