"""Driving plans in a few words, as a driver repeats directions: "left, then right after the second traffic light"."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from dorothie_gym.dialogue.numerals import cardinal, ordinal
from dorothie_gym.dialogue.routes import ConditionRelation, PlaceReference, PlanStep, StepAction, StepChange

MAX_WORDS: Final = 24
"""Number of words after which the rest of a plan is summed up."""

_PAST: Final = ConditionRelation.PAST

REST: Final = "and so on as you said"


def spoken_plan(steps: Sequence[PlanStep]) -> str:
    """Returns the words of a plan; steps behind the first `MAX_WORDS` words are summed up."""
    said: list[str] = []
    for step in steps:
        words = spoken_step(step)
        if said and len(" ".join((*said, words)).split()) > MAX_WORDS:
            return f"{', then '.join(said)}, {REST}"
        said.append(words)
    return ", then ".join(said)


def spoken_step(step: PlanStep) -> str:
    """Returns the words of a step, such as "the second left" or "straight on as far as Hubbard"."""
    words = [_SAID[step.action](step)]
    if step.speed is not None and step.action is not StepAction.SPEED:
        words.append(f"at {cardinal(step.speed)}")
    elif step.change is not None and step.action not in (StepAction.SPEED, StepAction.LIGHTS):
        words.append("slowly" if step.change is StepChange.SLOWER else "quickly")
    if step.condition is not None and step.action is StepAction.STRAIGHT and step.condition.relation is _PAST:
        words.append(f"past {step.condition.place.describe()}")
    elif step.condition is not None:
        words.append(step.condition.describe())
    if step.distance is not None:
        lasting = step.action in (StepAction.STRAIGHT, StepAction.FOLLOW, StepAction.GO)
        words.append(f"{'for' if lasting else 'in'} {_metres(step.distance)}")
    if step.side is not None:
        words.append(f"on the {step.side}-hand side")
    return " ".join(words)


def _metres(distance: int) -> str:
    if distance < 1000:
        return f"{cardinal(10 * round(distance / 10) if distance >= 20 else distance)} meters"
    return f"{cardinal(round(distance / 1000))} kilometer{'s' * (round(distance / 1000) > 1)}"


def _nth(number: int) -> str:
    return "next" if number == 1 else ordinal(number)


def _turn(step: PlanStep) -> str:
    side = str(step.direction) if step.direction is not None else "turn"
    if step.ordinal is not None:
        return f"the {_nth(step.ordinal)} {side}"
    return side if step.direction is not None else "the next turn"


def _straight(step: PlanStep) -> str:
    if step.ordinal is None:
        return "straight on"
    return f"straight across {cardinal(step.ordinal)} junctions" if step.ordinal > 1 else "straight across"


def _speed(step: PlanStep) -> str:
    return f"{cardinal(step.speed)} kilometers an hour" if step.speed is not None else f"{step.change or 'on'}"


def _lane(step: PlanStep) -> str:
    return "another lane" if step.direction is None else f"the {step.direction} lane"


def _with(words: str) -> Callable[[PlanStep], str]:
    def said(step: PlanStep) -> str:
        place: PlaceReference | None = step.place
        return words if place is None else f"{words} {place.describe()}".strip()

    return said


_SAID: Final[Mapping[StepAction, Callable[[PlanStep], str]]] = MappingProxyType(
    {
        StepAction.TURN: _turn,
        StepAction.STRAIGHT: _straight,
        StepAction.LANE: _lane,
        StepAction.U_TURN: _with("turn around"),
        StepAction.STOP: _with("stop"),
        StepAction.GO: _with("drive on"),
        StepAction.FOLLOW: _with("along"),
        StepAction.AVOID: _with("not over"),
        StepAction.SPEED: _speed,
        StepAction.LIGHTS: lambda step: f"lights {step.change}",
        StepAction.VISIT: _with(""),
        StepAction.WAIT: _with("wait"),
    }
)
