"""Decision loop of the scripted participant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.speaker_style import draw_style
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.participant.config import ParticipantConfig, ParticipantStyle
from dorothie_gym.policies.participant.contradictory_orders import admit_repetition, own_up
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.early_corrections import correct_early
from dorothie_gym.policies.participant.order_history import drop_repetition, note_said
from dorothie_gym.policies.participant.standstill import TURN_TIME, excuse_at_light
from dorothie_gym.policies.participant.state import ConversationState, ParticipantState
from dorothie_gym.policies.participant.subgoals import announce_target, choose_target, note_tasks, resume_after_wait
from dorothie_gym.policies.participant.turn_by_turn_guidance import follow_route, guide, watch
from dorothie_gym.policies.participant.unprompted_remarks import react, scene_of
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.persona import Persona, Trait
from dorothie_gym.policies.policy import TypedPolicy, replace
from dorothie_gym.policies.speech import SpeechState
from dorothie_gym.session.spaces.actions import ParticipantAction

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping


class ScriptedParticipant(TypedPolicy[ParticipantState]):
    """Rule-based participant that knows all places and directs the car to the subgoals of the storyboard.

    It names places or guides turn by turn (by its style, drawn for each session), answers questions, corrects wrong
    turns, reports completed subgoals, and announces changes of the tasks.
    """

    def __init__(
        self,
        limits: SpaceLimits | None = None,
        style: ParticipantStyle | None = None,
        config: ParticipantConfig | None = None,
        traits: Mapping[str, Trait] | None = None,
    ) -> None:
        """Prepares the policy.

        Args:
            limits: sizes of the spaces.
            style: style; None draws a persona for each session, and its style follows from it.
            config: tunable numbers; None takes the defaults.
            traits: values or ranges of traits of the personas that are drawn, see `parse_traits`.
        """
        super().__init__(Role.PARTICIPANT, limits)
        self._style, self._traits = style, traits
        self._config = ParticipantConfig() if config is None else config

    def initial_state(self, seed: int, town: Town) -> ParticipantState:
        """Returns the state at the start of a session."""
        rng = np.random.default_rng((seed, 0))
        persona = Persona.draw(rng, self._traits) if self._style is None else None
        style = self._style or ParticipantStyle.of(persona or Persona(), rng)
        chat_at = float(rng.uniform(25.0, style.chat + 25.0))
        speech = SpeechState(
            role=Role.PARTICIPANT,
            style=draw_style(Role.PARTICIPANT, rng, None if persona is None else persona.leanings),
        )
        if persona is not None:
            speech = replace(speech, delivery=persona.delivery)
        return ParticipantState(
            seed=seed,
            town=town,
            style=style,
            config=self._config,
            speech=speech,
            persona=persona,
            conversation=ConversationState(chat_at=chat_at),
        )

    def persona_of(self, state: ParticipantState) -> Mapping[str, float | str] | None:
        """Returns the traits of the session's persona."""
        return None if state.persona is None else state.persona.to_json()

    def act(
        self, observation: ObservationMapping, state: ParticipantState
    ) -> tuple[ParticipantAction, ParticipantState]:
        """Processes utterances, observes the car, and chooses a remark or silence."""
        updated, rng = state.next_decision()
        view = ParticipantView.read(observation, updated.town)
        updated.clock = updated.clock.ticked(view.time)
        if view.turning and updated.motion.standstill(view.time) > TURN_TIME:
            view = replace(view, turning=False)
        updated.motion = updated.motion.observed(view.time, standing=view.standing)
        updated.trip = updated.trip.moved(view.position, view.time, standing=view.standing)
        excuse_at_light(updated, view)
        note_tasks(updated, view, rng)
        choose_target(updated, view, rng)
        follow_route(updated, view)
        listen(updated, view, rng)
        announce_target(updated, view, rng)
        resume_after_wait(updated, view)
        watch(updated, view)
        guide(updated, view, rng)
        correct_early(updated, view, rng)
        react(updated, view, rng)
        admit_repetition(updated, view)
        own_up(updated, view)
        scene = None if updated.speech.idle else scene_of(updated, view)
        speech, updated.speech = updated.speech.speak(
            view.time, view.speaking, rng, scene, interval=updated.clock.interval, other_speaking=view.other_speaking
        )
        if speech is not None and updated.speech.last is not None:
            note_said(updated, view, updated.speech.last)
            drop_repetition(updated, updated.speech.last)
        updated.motion = updated.motion.with_speed(view.speed)
        return ParticipantAction(speech=speech), updated
