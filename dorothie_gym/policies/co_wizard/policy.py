"""Decision loop of the scripted Co-Wizard."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.dialogue.speaker_style import draw_style
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.co_wizard.config import CoWizardConfig, CoWizardStyle
from dorothie_gym.policies.co_wizard.described_looks import compare_looks
from dorothie_gym.policies.co_wizard.destinations import note_plan, recognise_goal, search_on
from dorothie_gym.policies.co_wizard.dialogue_update import listen
from dorothie_gym.policies.co_wizard.driving import creep, drive, end_red_light_rest, junction_ahead, rest
from dorothie_gym.policies.co_wizard.intentions import Intentions
from dorothie_gym.policies.co_wizard.obstacles import watch_road
from dorothie_gym.policies.co_wizard.plan_execution import keep_plan
from dorothie_gym.policies.co_wizard.proposition_truth import reason_to_stand
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.unprompted_remarks import announce_action, scene_of, take_initiative
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.persona import Persona, Trait
from dorothie_gym.policies.policy import TypedPolicy, replace
from dorothie_gym.policies.speech import SpeechState
from dorothie_gym.session.spaces.actions import CoWizardAction, Mental, Physical
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping


class ScriptedCoWizard(TypedPolicy[CoWizardState]):
    """Rule-based Co-Wizard: understands instructions, plans with its beliefs, drives, asks, confirms and explains.

    It knows the map without hidden places. It drives to places on the map by its own route; to others it is guided by
    the participant. Mental actions record its beliefs.
    """

    def __init__(
        self,
        limits: SpaceLimits | None = None,
        style: CoWizardStyle | None = None,
        config: CoWizardConfig | None = None,
        traits: Mapping[str, Trait] | None = None,
    ) -> None:
        """Prepares the policy.

        Args:
            limits: sizes of the spaces.
            style: style; None draws a persona for each session, and its style follows from it.
            config: tunable numbers; None takes the defaults.
            traits: values or ranges of traits of the personas that are drawn, see `parse_traits`.
        """
        super().__init__(Role.CO_WIZARD, limits)
        self._style, self._traits = style, traits
        self._config = CoWizardConfig() if config is None else config

    def initial_state(self, seed: int, town: Town) -> CoWizardState:
        """Returns the state at the start of a session."""
        rng = np.random.default_rng((seed, 0))
        persona = Persona.draw(rng, self._traits) if self._style is None else None
        style = self._style or CoWizardStyle.of(persona or Persona(), rng)
        speech = SpeechState(
            role=Role.CO_WIZARD, style=draw_style(Role.CO_WIZARD, rng, None if persona is None else persona.leanings)
        )
        if persona is not None:
            speech = replace(speech, delivery=persona.delivery)
        return CoWizardState(
            seed=seed,
            town=town,
            style=style,
            config=self._config,
            speech=speech,
            persona=persona,
            intentions=Intentions(speed=style.pace, usual=style.pace),
        )

    def persona_of(self, state: CoWizardState) -> Mapping[str, float | str] | None:
        """Returns the traits of the session's persona."""
        return None if state.persona is None else state.persona.to_json()

    def act(self, observation: ObservationMapping, state: CoWizardState) -> tuple[CoWizardAction, CoWizardState]:
        """Processes utterances and observation, drives, and possibly speaks."""
        decision = attend(observation, state)
        updated, view = decision.state, decision.view
        rest(updated, view, decision.rng)
        end_red_light_rest(updated, view)
        return respond(decision, drive(updated, view)), updated


class PendingDecision(NamedTuple):
    """Decision in progress: the updated state, the observation, and the random generator of the decision."""

    state: CoWizardState
    view: CoWizardView
    rng: np.random.Generator


def attend(observation: ObservationMapping, state: CoWizardState) -> PendingDecision:
    """Updates the state from an observation: the first part of a decision, before acting and speaking.

    Args:
        observation: observation of the Co-Wizard.
        state: state of the previous decision; it is not changed.
    """
    updated, rng = state.next_decision()
    view = CoWizardView.read(observation, updated.town)
    updated.clock = updated.clock.ticked(view.time)
    update_route(updated, view)
    listen(updated, view, rng)
    watch_road(updated, view, rng)
    search_on(updated, view)
    recognise_goal(updated, view)
    compare_looks(updated, view)
    keep_plan(updated, view)
    creep(updated, view)
    return PendingDecision(updated, view, rng)


def respond(decision: PendingDecision, physical: Physical | None) -> CoWizardAction:
    """Chooses speech and belief update: the last part of a decision.

    Args:
        decision: result of `attend`; its state is updated.
        physical: physical action of the decision.
    """
    state, view, rng = decision
    if view.standing:
        state.standstill = state.standstill.with_reason(reason_to_stand(state.knowledge, view), view.time)
    announce_action(state, view, physical, rng)
    take_initiative(state, view, rng)
    scene = None if state.speech.idle else scene_of(state, view)
    speech, state.speech = state.speech.speak(
        view.time, view.speaking, rng, scene, interval=state.clock.interval, other_speaking=view.other_speaking
    )
    return CoWizardAction(speech=speech, physical=physical, mental=_next_update(state))


def update_route(state: CoWizardState, view: CoWizardView) -> None:
    """Updates standstill, directive and route with the position of the car."""
    state.standstill = state.standstill.observed(view.time, standing=view.standing)
    if view.manoeuvring and not view.standing:
        state.commands = state.commands.manoeuvring(view.time)
    if view.motion is Motion.HAZARD and view.hazard is ObjectClass.TRAFFIC_LIGHT:
        # the manoeuvre cannot begin before the light is green
        state.intentions = state.intentions.wishing_until(view.time + state.config.red_light_extension)
    if view.standing or view.manoeuvre is PhysicalAction.U_TURN:
        state.intentions = state.intentions.slow_longer(state.clock.interval)
    _pass_junction(state, view)
    if state.route.progress is None or view.manoeuvring:
        return
    before = state.route.progress.left(view.station)
    former = state.route.progress.followed(state.town, view.lane, view.station)
    state.route = state.route.with_progress(former)
    if former.astray >= state.config.replan_after:
        state.route = state.route.replanned(state.town, view.here)
        if state.route.has_missed(before, view.station):
            state.route = state.route.after_miss(state.town, view.here, former)
        note_plan(state)


def _pass_junction(state: CoWizardState, view: CoWizardView) -> None:
    """Drops a directive when its junction has been passed, or counts down the junctions to skip."""
    directive, choice = state.intentions.directive, junction_ahead(state, view)
    if directive is None or choice is None or view.manoeuvring:
        return
    if directive.junction == choice.junction:
        return
    passed = directive.junction >= 0
    if passed and directive.skip == 0:
        state.intentions = state.intentions.directed(None)
    else:
        updated = replace(directive, skip=max(directive.skip - passed, 0), junction=choice.junction)
        state.intentions = state.intentions.directed(updated)


def _next_update(state: CoWizardState) -> Mental | None:
    """Takes the next belief update off the queue."""
    if not state.beliefs.updates:
        return None
    first = state.beliefs.updates[0]
    state.beliefs = state.beliefs.after_sending()
    return first
