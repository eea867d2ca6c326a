"""The scripted participant, decision by decision."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from dorothie_gym.dialogue import draw_style
from dorothie_gym.maps import Town
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology import Role
from dorothie_gym.policies.participant.config import ParticipantStyle
from dorothie_gym.policies.participant.goals import choose_target, go_on, note_tasks, tell_target
from dorothie_gym.policies.participant.guidance import follow_journey, guide, watch
from dorothie_gym.policies.participant.reactions import react, scene_of
from dorothie_gym.policies.participant.replies import listen
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.policy import Policy
from dorothie_gym.policies.route_progress import light_ahead
from dorothie_gym.policies.speech import SpeechState
from dorothie_gym.spaces import ActionDict, ParticipantAction, SpaceLimits

LONGEST_RED = 60.0
"""A car that has been standing for longer than this does not stand because of a light [s]."""

NEARLY_THERE = 45.0
"""A car that has been stopped this near to the place does not stand because of a light [m]."""

START = 8.0
"""A car is given this long to start after a light has turned green, for others may be before it [s]."""


class ScriptedParticipant(Policy[ParticipantState]):
    """A human who wants the storyboard's tasks done and knows where everything is.

    It names places or tells the way turn by turn (its style, drawn for each session), answers the car's questions,
    corrects wrong turns, reports what is done, and takes up changes of the task.
    """

    def __init__(self, limits: SpaceLimits | None = None, style: ParticipantStyle | None = None) -> None:
        """Prepares the policy.

        Args:
            limits: sizes of the spaces.
            style: how it talks; drawn for each session where None.
        """
        super().__init__(Role.PARTICIPANT, limits)
        self._style = style

    def initial_state(self, seed: int, town: Town) -> ParticipantState:
        """A participant who has not said anything yet."""
        rng = np.random.default_rng((seed, 0))
        style = ParticipantStyle.draw(rng) if self._style is None else self._style
        chat_at = float(rng.uniform(25.0, style.chat + 25.0))
        voice = SpeechState(role=Role.PARTICIPANT, style=draw_style(Role.PARTICIPANT, rng))
        return ParticipantState(seed=seed, town=town, style=style, chat_at=chat_at, voice=voice)

    def step(self, observation: Mapping[str, Any], state: ParticipantState) -> tuple[ActionDict, ParticipantState]:
        """Listens, looks, and says something or nothing."""
        mind = copy(state)
        mind.count += 1
        rng = np.random.default_rng((mind.seed, mind.count))
        view = ParticipantView.read(observation, mind.town)
        if view.turning and mind.standing_since is not None and view.time - mind.standing_since > 4.0:
            view = replace(view, turning=False)  # it does not go on turning by itself
        if not view.standing:
            mind.standing_since, mind.stood_since = None, view.time
        elif mind.standing_since is None:
            mind.standing_since = view.time
        _excuse_at_light(mind, view)
        note_tasks(mind, view, rng)
        choose_target(mind, view, rng)
        follow_journey(mind, view)
        listen(mind, view, rng)
        tell_target(mind, view, rng)
        go_on(mind, view)
        watch(mind, view)
        guide(mind, view, rng)
        react(mind, view, rng)
        scene = None if mind.voice.idle else scene_of(mind, view)
        speech, mind.voice = mind.voice.speak(view.time, view.speaking, rng, scene)
        mind.speed_before = view.speed
        return ParticipantAction(speech=speech).encode(self.limits), mind


def _excuse_at_light(mind: ParticipantState, view: ParticipantView) -> None:
    """Nobody wonders about a car that waits before a red light, nor right after it has turned green."""
    last_stretch = (
        mind.guiding
        and mind.journey is not None
        and mind.journey.left(view.station) < NEARLY_THERE
        and mind.journey.next_crossing(mind.town, view.station) is None
    )
    if not view.standing or last_stretch or view.time - mind.stood_since > LONGEST_RED:
        return
    if light_ahead(mind.town, view.lane, view.station, view.time) in (None, LightColour.GREEN):
        return
    mind.standing_since = view.time
    mind.excused_until = max(mind.excused_until, view.time + START)
