"""Rides: sessions of the scripted Co-Wizard with a participant that says what a test wants, and nothing else."""

from __future__ import annotations

import math
from typing import Any

from dorothie_gym.dialogue import DrivingPlan
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import DialogueAct, DialogueMove, LandmarkName, Role
from dorothie_gym.policies import ScriptedCoWizard
from dorothie_gym.policies.co_wizard.plan_acceptance import take_plan
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.road_ahead import RoadAhead
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import CoWizardAction, ParticipantAction, Speech, noop
from dorothie_gym.support.portable_math import wrap_degrees


class Ride:
    """Session whose car is driven by the scripted Co-Wizard; records its lanes and what it says."""

    def __init__(self, seed: int, town: str = "brookside", *, acts: bool = False) -> None:
        config = EnvConfig(observe_acts=acts, word_error_rate=0.0, max_seconds=400.0)
        self.env = DuoWizardEnv(town=town, config=config)
        self.observations, _ = self.env.reset(seed=seed)
        self.policy = ScriptedCoWizard(self.env.limits)
        self.state = self.policy.initial_state(seed, self.env.town)
        self.lanes: list[tuple[int, float]] = [self.here]
        self.said: list[Speech] = []

    @property
    def here(self) -> tuple[int, float]:
        true = self.observations["participant"]
        return int(true["lane"]), float(true["station"][0])

    @property
    def position(self) -> tuple[float, float]:
        x, y, _ = self.observations["participant"]["pose"]
        return float(x), float(y)

    @property
    def speed(self) -> float:
        return float(self.observations["participant"]["speed"][0])

    @property
    def road(self) -> RoadAhead:
        return RoadAhead.straight_on(self.env.town, self.here)

    @property
    def words(self) -> str:
        return " ".join(speech.text for speech in self.said)

    @property
    def moves(self) -> list[DialogueMove]:
        return [speech.act.move for speech in self.said]

    def marks(self) -> dict[LandmarkName, tuple[float, float]]:
        marks = self.env.scenario.storyboard.landmarks
        return {mark.name: mark.position for mark in marks if not mark.hidden}

    def step(self, text: str = "") -> None:
        limits = self.env.limits
        speech = Speech(act=DialogueAct.of(DialogueMove.INSTRUCT), text=text) if text else None
        action, self.state = self.policy.step(self.observations["co_wizard"], self.state)
        done = CoWizardAction.decode(action, limits)
        if done.speech is not None:
            self.said.append(done.speech)
        self.observations, *_ = self.env.step(
            {
                "participant": ParticipantAction(speech=speech).encode(limits),
                "co_wizard": action,
                "ad_wizard": noop(Role.AD_WIZARD, limits),
            }
        )
        self.lanes.append(self.here)

    def run(self, seconds: float) -> None:
        for _ in range(round(2 * seconds)):
            self.step()

    def say(self, text: str, seconds: float = 8.0) -> None:
        self.step(text)
        self.run(seconds)

    def order(self, *steps: dict[str, Any], text: str = "as I say") -> None:
        """Lets the Co-Wizard hear a plan, without the parser of words."""
        updated, rng = self.state.next_decision()
        view = CoWizardView.read(self.observations["co_wizard"], self.env.town)
        words = replace(understand(text), plan=DrivingPlan.from_json(list(steps)))
        acts = (DialogueAct.of(DialogueMove.INSTRUCT),)
        take_plan(updated, view, HeardUtterance(acts=acts, words=words), rng)
        self.state = updated

    def turns(self) -> list[str]:
        """Returns how the car left the junctions with several ways that it has passed."""
        lanes, found, before, inside = self.env.town.lanes, [], None, False
        for lane, station in self.lanes:
            if lanes[lane].in_junction:
                inside = True
                continue
            if before is not None and inside and len(self.env.town.exits(before)) > 1:
                change = lanes[before].headings[-1] - lanes[lane].heading_at(station)
                angle = wrap_degrees(math.degrees(float(change)))
                found.append("straight" if abs(angle) < 40.0 else "left" if angle > 0.0 else "right")
            before, inside = lane, False
        return found
