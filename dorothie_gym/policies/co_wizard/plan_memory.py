"""Memory of the Co-Wizard for a driving plan: the steps that wait, and how far the present one has come."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Final

from dorothie_gym.dialogue.routes import PlanStep, StepAction
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.co_wizard.intentions import Directive
from dorothie_gym.policies.policy import replace

NO_JUNCTION: Final = -1
"""Id where a step is due at no junction."""

STEERING: Final = frozenset({StepAction.TURN, StepAction.STRAIGHT, StepAction.FOLLOW})
"""Steps that say how to cross junctions."""


@dataclass(frozen=True, kw_only=True)
class DuePoint:
    """Point of the road at which a step is due.

    Attributes:
        junction: id of the junction at which it is carried out, or that is passed; `NO_JUNCTION` for none.
        passed: whether the step is over when the junction has been passed, rather than when it is the next.
        place: place at which it is carried out, where that is no junction.
        object: class of an object at whose sight it is carried out.
    """

    junction: int = NO_JUNCTION
    passed: bool = False
    place: Place | None = None
    object: ObjectClass | None = None


class StepStage(enum.Enum):
    """Stage of the present step."""

    WAITING = "waiting"
    """Its point of the road has not been reached."""
    BEGUN = "begun"
    """The car has been told to carry it out."""
    UNDER_WAY = "under_way"
    """The car carries it out."""


@dataclass(frozen=True, kw_only=True)
class PlanMemory:
    """Driving plan that the participant has asked for.

    Attributes:
        steps: steps that have not been carried out, the present one first.
        due: point of the present step; None while it has not been looked for.
        stage: stage of the present step.
        since: time since which the car has waited in the present step [s].
        issued: turn that the plan wants at the next junction, as it was last given to the driving.
        approach: lane from which the junction of the present turn was approached.
        angle: angle of the exit to take there [degrees].
        missed: number of times that the present turn was missed.
        start: place at which the drive began.
        stops: place of the last stop that the participant asked for.
    """

    steps: tuple[PlanStep, ...] = ()
    due: DuePoint | None = None
    stage: StepStage = StepStage.WAITING
    since: float = 0.0
    issued: Directive | None = None
    approach: int = -1
    angle: int = 0
    missed: int = 0
    start: Place | None = None
    stops: Place | None = None

    @property
    def present(self) -> PlanStep | None:
        """The step that is carried out now or next; None without any."""
        return self.steps[0] if self.steps else None

    @property
    def stops_soon(self) -> bool:
        """Returns whether the car is coming up to the place of a stop."""
        step = self.present
        return step is not None and step.action is StepAction.STOP and self.stage is not StepStage.WAITING

    def taken(self, steps: tuple[PlanStep, ...]) -> PlanMemory:
        """Takes over a plan in place of the steps that wait."""
        return replace(self._fresh(), steps=steps, issued=None)

    def continued(self, steps: tuple[PlanStep, ...]) -> PlanMemory:
        """Adds steps behind those that wait."""
        return replace(self, steps=(*self.steps, *steps))

    def corrected(self, step: PlanStep) -> PlanMemory:
        """Replaces the present step."""
        return replace(self._fresh(), steps=(step, *self.steps[1:]), issued=None)

    def advanced(self) -> PlanMemory:
        """Completes the present step."""
        return replace(self._fresh(), steps=self.steps[1:])

    def dropped(self) -> PlanMemory:
        """Forgets all steps."""
        return replace(self._fresh(), steps=(), issued=None)

    def _fresh(self) -> PlanMemory:
        return replace(self, due=None, stage=StepStage.WAITING, since=0.0, approach=-1, missed=0)

    def at(self, due: DuePoint | None) -> PlanMemory:
        """Sets the point of the present step."""
        return replace(self, due=due)

    def staged(self, stage: StepStage, now: float) -> PlanMemory:
        """Sets the stage of the present step at a time [s]."""
        return self if stage is self.stage else replace(self, stage=stage, since=now)

    def issuing(self, directive: Directive | None) -> PlanMemory:
        """Records the turn that is wanted at the next junction."""
        return replace(self, issued=directive)

    def approaching(self, lane: int, angle: int) -> PlanMemory:
        """Records the lane before the junction of a turn, and the angle of the exit [degrees]."""
        return replace(self, approach=lane, angle=angle)

    def after_miss(self) -> PlanMemory:
        """Looks for the next opportunity of a turn that was not taken."""
        return replace(self._fresh(), missed=self.missed + 1)

    def with_start(self, place: Place) -> PlanMemory:
        """Records where the drive began."""
        return replace(self, start=place)

    def with_stop(self, place: Place) -> PlanMemory:
        """Records where the car has stopped on request."""
        return replace(self, stops=place)
