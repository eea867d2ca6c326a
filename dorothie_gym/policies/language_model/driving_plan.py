"""Driving plan on the Co-Wizard's page: the steps that it still means to take, in the language of routes.

The model writes the plan in words, or takes over the steps that the passenger has asked for. Steps leave the page when
the car has carried them out. The junctions of a plan are sent as a `PlanUpdate`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.routes import DrivingPlan, PlanStep, StepAction
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.road_ahead import RoadAhead
from dorothie_gym.policies.route_progress import Choice, direction_of, find_exit, lanes_beside
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView

PLAN_LENGTH: Final = 240
"""Longest text of a plan [characters]."""

AS_ASKED: Final = "as asked"
"""Text of a plan that takes over the steps that the passenger has asked for last."""

_MANOEUVRES: Final = {PhysicalAction.U_TURN: StepAction.U_TURN, PhysicalAction.LANE_SWITCH: StepAction.LANE}
_PASSING: Final = frozenset({StepAction.SPEED, StepAction.LIGHTS, StepAction.LANE, StepAction.GO, StepAction.AVOID})
"""Steps that a later one can overtake: they are over when that one is."""


@dataclass(frozen=True, kw_only=True)
class PlanPad:
    """Plan of the model, what the passenger has asked for, and where the car was.

    Attributes:
        steps: steps that are still to be taken, the next first.
        asked: steps of the passenger's last directions that have several, or a place for one.
        lane: last lane outside junctions; -1 before the first.
        manoeuvre: manoeuvre at the last decision.
        stood: whether the car stood as ordered at the last decision.
    """

    steps: tuple[PlanStep, ...] = ()
    asked: tuple[PlanStep, ...] = ()
    lane: int = -1
    manoeuvre: PhysicalAction | None = None
    stood: bool = False

    def heard(self, words: str) -> PlanPad:
        """Keeps the steps of an utterance of the passenger, if they are more than a single order."""
        steps = understand(words).plan.steps
        plain = len(steps) == 1 and not _waits(steps[0])
        return replace(self, asked=() if plain else steps) if steps else self

    def written(self, words: str) -> PlanPad | None:
        """Takes over the plan that words describe; None if they contain no step."""
        steps = self.asked if words == AS_ASKED else understand(words).plan.steps
        return replace(self, steps=steps) if steps else None

    def followed(self, town: Town, view: CoWizardView) -> PlanPad:
        """Drops the steps that the car has carried out since the last decision."""
        pad, lane = self, town.lanes[view.lane]
        stood = view.motion is Motion.STOPPED and view.standing
        if stood and not self.stood:
            pad = pad._done(StepAction.STOP)
        if self.stood and view.motion is Motion.DRIVING:
            pad = pad._done(StepAction.GO)
        ended = None if self.manoeuvre is view.manoeuvre else self.manoeuvre
        if ended in _MANOEUVRES:
            pad = pad._done(_MANOEUVRES[ended])
        if lane.in_junction:
            return replace(pad, manoeuvre=view.manoeuvre, stood=stood)
        if self.lane not in (-1, view.lane):
            pad = pad._crossed(town, view.lane)
        return replace(pad, lane=view.lane, manoeuvre=view.manoeuvre, stood=stood)

    def _crossed(self, town: Town, lane: int) -> PlanPad:
        """Drops, or counts down, the step that the way across a junction carries out."""
        exits = [way for one in (self.lane, *lanes_beside(town, self.lane)) for way in town.exits(one)]
        there = (lane, *lanes_beside(town, lane))
        taken = next((direction_of(way) for way in exits if way.lane in there), None)
        open_ways = {direction_of(way) for way in exits}
        if taken is None or len(open_ways) < 2:
            return self
        number = self._next_of(StepAction.TURN, StepAction.STRAIGHT)
        if number is None:
            return self
        step = self.steps[number]
        wanted = Direction.STRAIGHT if step.action is StepAction.STRAIGHT else step.direction
        straight = taken is Direction.STRAIGHT
        counted = step.ordinal is not None and step.ordinal > 1
        if straight and counted and (wanted is None or wanted in open_ways):
            fewer = dataclasses.replace(step, ordinal=(step.ordinal or 2) - 1)
            return replace(self, steps=(*self.steps[:number], fewer, *self.steps[number + 1 :]))
        if taken is wanted or (wanted is None and not straight):
            return replace(self, steps=self.steps[number + 1 :])
        return self

    def _done(self, action: StepAction) -> PlanPad:
        number = self._next_of(action)
        return self if number is None else replace(self, steps=self.steps[number + 1 :])

    def _next_of(self, *actions: StepAction) -> int | None:
        """Returns the index of the next step if it has one of some actions; what it may overtake does not count."""
        for number, step in enumerate(self.steps):
            if step.action in actions:
                return number
            if step.action not in _PASSING:
                return None
        return None

    def lines(self) -> list[str]:
        """Returns the steps in words, a line each."""
        return [f"- {step.describe()}" for step in self.steps]

    def asked_words(self) -> str:
        """Returns what the passenger has asked for in words; empty if that was no more than a single order."""
        return DrivingPlan(self.asked).describe()


def _waits(step: PlanStep) -> bool:
    """Returns whether a step is not due at the next opportunity, but at a named place or number."""
    named = step.condition is not None and step.condition.place.reference is None
    return named or (step.ordinal or 1) > 1


def planned_junctions(town: Town, here: Place, steps: Sequence[PlanStep]) -> tuple[int, ...]:
    """Returns the ids of the junctions of a plan in order, as far as the map shows where its steps are due.

    Args:
        town: the map.
        here: place of the car.
        steps: the steps; the first one with a condition or a distance ends what can be foreseen.
    """
    junctions: list[int] = []
    for step in steps:
        if step.action in _PASSING:
            continue
        direction = Direction.STRAIGHT if step.action is StepAction.STRAIGHT else step.direction
        steers = step.action in (StepAction.TURN, StepAction.STRAIGHT)
        if not steers or direction is None or step.condition is not None or step.distance is not None:
            break
        ahead = RoadAhead.straight_on(town, here).crossings
        fitting = [number for number, crossing in enumerate(ahead) if crossing.leads(direction)]
        if len(fitting) < (step.ordinal or 1):
            break
        last = ahead[fitting[(step.ordinal or 1) - 1]]
        junctions += [crossing.junction for crossing in ahead[: ahead.index(last) + 1]]
        way = find_exit(town, Choice(lane=last.lane, distance=0.0, exits=last.exits), direction)
        if way is None:
            break
        here = way.lane, 0.0
    return tuple(junctions)
