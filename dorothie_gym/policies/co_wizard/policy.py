"""The scripted Co-Wizard, decision by decision."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from dorothie_gym.dialogue import draw_style
from dorothie_gym.maps import Town
from dorothie_gym.ontology import ObjectClass, Role
from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.co_wizard.driving import creep, drive, rest, see_green
from dorothie_gym.policies.co_wizard.goals import note_plan, search_on
from dorothie_gym.policies.co_wizard.initiative import scene_of, speak_up, tell_action
from dorothie_gym.policies.co_wizard.obstacles import watch_road
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.understanding_update import listen
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.policy import Policy
from dorothie_gym.policies.speech import SpeechState
from dorothie_gym.spaces import ActionDict, CoWizardAction, Mental, Motion, Physical, SpaceLimits

ASTRAY = 2
"""After so many decisions off the plan it is made anew."""

CLOSE_BY = 150.0
"""Who leaves the way with the goal nearer than this, [m]"""

AROUND = 60.0
"""and then is farther from it by more than this, has missed it [m]."""

AFTER_RED = 15.0
"""A manoeuvre that was asked for is not given up before this time after a red light [s]."""


class ScriptedCoWizard(Policy[CoWizardState]):
    """A car's mind that is told where to go: it believes, plans, drives, asks, confirms and explains.

    It knows the map without hidden places. Places it knows it drives to by its own plan; to others it is guided by
    words. What it believes it notes by mental actions.
    """

    def __init__(self, limits: SpaceLimits | None = None, style: CoWizardStyle | None = None) -> None:
        """Prepares the policy.

        Args:
            limits: sizes of the spaces.
            style: how it talks; drawn for each session where None.
        """
        super().__init__(Role.CO_WIZARD, limits)
        self._style = style

    def initial_state(self, seed: int, town: Town) -> CoWizardState:
        """A Co-Wizard that has not been told anything yet."""
        rng = np.random.default_rng((seed, 0))
        style = CoWizardStyle.draw(rng) if self._style is None else self._style
        voice = SpeechState(role=Role.CO_WIZARD, style=draw_style(Role.CO_WIZARD, rng))
        return CoWizardState(seed=seed, town=town, style=style, voice=voice, speed=style.pace, usual=style.pace)

    def step(self, observation: Mapping[str, Any], state: CoWizardState) -> tuple[ActionDict, CoWizardState]:
        """Listens, looks, drives, and says something or nothing."""
        attention = attend(observation, state)
        mind, view = attention.mind, attention.view
        rest(mind, view, attention.rng)
        see_green(mind, view)
        return respond(attention, drive(mind, view)).encode(self.limits), mind


class PendingDecision(NamedTuple):
    """A decision in progress: the mind, which is brought up to date, what is seen, and chance."""

    mind: CoWizardState
    view: CoWizardView
    rng: np.random.Generator


def attend(observation: Mapping[str, Any], state: CoWizardState) -> PendingDecision:
    """Listens and looks: the first part of a decision, before anything is done or said.

    Args:
        observation: of the Co-Wizard.
        state: its mind; it is left as it is.
    """
    mind = copy(state)
    mind.count += 1
    rng = np.random.default_rng((mind.seed, mind.count))
    view = CoWizardView.read(observation, mind.town)
    _notice(mind, view)
    listen(mind, view, rng)
    watch_road(mind, view, rng)
    search_on(mind, view)
    creep(mind, view)
    return PendingDecision(mind, view, rng)


def respond(attention: PendingDecision, physical: Physical | None) -> CoWizardAction:
    """Says something or nothing, and notes what is believed: the last part of a decision.

    Args:
        attention: of `attend`.
        physical: what the car does.
    """
    mind, view, rng = attention
    tell_action(mind, view, physical, rng)
    speak_up(mind, view, rng)
    scene = None if mind.voice.idle else scene_of(mind, view)
    speech, mind.voice = mind.voice.speak(view.time, view.speaking, rng, scene)
    return CoWizardAction(speech=speech, physical=physical, mental=_next_note(mind))


def _notice(mind: CoWizardState, view: CoWizardView) -> None:
    """Brings plan and directive up to where the car is."""
    if not view.standing:
        mind.standing_since = None
    elif mind.standing_since is None:
        mind.standing_since = view.time
    if view.motion is Motion.HAZARD and view.hazard is ObjectClass.TRAFFIC_LIGHT:
        mind.wish_until = max(mind.wish_until, view.time + AFTER_RED)  # there is no place for it before
    _pass_junction(mind, view)
    if mind.journey is None or view.manoeuvring:
        return
    before = mind.journey.left(view.station)
    mind.journey = mind.journey.followed(mind.town, view.lane, view.station)
    if mind.journey.astray >= ASTRAY:
        _plan_anew(mind, view, before)


def _plan_anew(mind: CoWizardState, view: CoWizardView, before: float) -> None:
    """Plans another way; who has missed the goal again and again does not come to it as before."""
    assert mind.journey is not None
    former = mind.journey
    mind.journey = former.replanned(mind.town, view.here, mind.blocked + mind.avoided)
    if before < CLOSE_BY and mind.journey.left(view.station) > before + AROUND:
        mind.misses += 1
        way_in = former.way_in()
        if mind.misses > 1 and way_in is not None:
            mind.avoided = (*mind.avoided, way_in)
            mind.journey = former.replanned(mind.town, view.here, mind.blocked + mind.avoided)
    note_plan(mind)


def _pass_junction(mind: CoWizardState, view: CoWizardView) -> None:
    """Drops a directive when its junction has been passed, or counts down to it."""
    directive = mind.directive
    if directive is None or view.choice is None or view.manoeuvring:
        return
    if directive.junction == view.junction:
        return
    passed = directive.junction >= 0
    if passed and directive.skip == 0:
        mind.directive = None
    else:
        mind.directive = replace(directive, skip=max(directive.skip - passed, 0), junction=view.junction)


def _next_note(mind: CoWizardState) -> Mental | None:
    if not mind.notes:
        return None
    first, mind.notes = mind.notes[0], mind.notes[1:]
    return first
