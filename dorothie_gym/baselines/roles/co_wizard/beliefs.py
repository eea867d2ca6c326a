"""Evidence of the learned Co-Wizard for or against a proposition, from its own observation, memory and map."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from dorothie_gym.baselines.roles.co_wizard.memory import Memory
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.slots import ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.policies.co_wizard.proposition_truth import (
    DETOUR_TIME,
    is_localised,
    is_located,
    is_red_ahead,
    present_action,
    sees,
    sees_far,
)
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.travel_time import travel_time
from dorothie_gym.policies.view_range import camera_fault
from dorothie_gym.sim.state.codes import Motion

LOST_VARIANCE, GPS_VARIANCE = 36.0, 0.18
"""Variances of the position: the car does not know where it is; the position is not measured [m^2]."""

CLOSE_DISTANCE: Final = 120.0
"""Way to the goal that is called short [m]."""

CROWD: Final = 3
"""Least number of people or vehicles in a crowd."""

_Evidence = Callable[[Memory, CoWizardView, Proposition], bool | None]


def evidence(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether a proposition seems true; None where nothing tells."""
    judge = _EVIDENCE.get(said.predicate)
    found = None if judge is None else judge(memory, view, said)
    return found if found is None else found is not said.negated


def goal_left(memory: Memory, view: CoWizardView) -> float | None:
    """Returns the way to a goal on the map [m]; None without one."""
    return memory.navigator.left(view) if memory.goal_mark >= 0 else None


def seconds_to_goal(memory: Memory, view: CoWizardView) -> int | None:
    """Returns the expected time until the car stops at a goal on the map [s]; None without one, or if the car halts."""
    progress = memory.navigator.route.progress
    if progress is None or memory.goal_mark < 0 or memory.value("halted"):
        return None
    seconds = travel_time(memory.town, progress, view.station, view.time, view.speed)
    return round(seconds) if math.isfinite(seconds) else None


def _about_goal(memory: Memory, said: Proposition) -> bool:
    return said.get("place") in (None, memory.goal)


def _on_street(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    here = street_of(view.raw, memory.town, view.lane)
    if here is StreetName.UNKNOWN or not is_localised(view, LOST_VARIANCE):
        return None
    return here is said.get("street")


def _close(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    left = goal_left(memory, view)
    return None if left is None or not _about_goal(memory, said) else left < CLOSE_DISTANCE


def _knows(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    place = said.get("place") or memory.goal
    return any(mark.name is place and mark.place not in memory.ruled_out for mark in view.landmarks)


def _right_way(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    progress = memory.navigator.route.progress
    return None if progress is None or memory.goal_mark < 0 else not progress.astray


def _failed(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    found = {camera_fault(view.raw), None if is_localised(view, GPS_VARIANCE) else Sensor.GPS} - {None}
    asked = said.get("sensor")
    return bool(found) if asked is None else asked in found


def _blocked(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether the car has met an obstacle lately, or sees one."""
    met = view.time - memory.navigator.blocked_at < DETOUR_TIME
    return met or view.hazard is ObjectClass.STATIC or any(thing.kind is ObjectClass.STATIC for thing in view.objects)


def _crowded(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    return sum(thing.kind is said.get("object") for thing in view.objects) >= CROWD


def _has_goal(memory: Memory, view: CoWizardView, said: Proposition) -> bool | None:
    return memory.goal is not None and _about_goal(memory, said)


_EVIDENCE: Final[dict[Predicate, _Evidence]] = {
    Predicate.SEES: lambda memory, view, said: sees(view, said),
    Predicate.ON_STREET: _on_street,
    Predicate.LOCATED: lambda memory, view, said: is_located(view, said),
    Predicate.CLOSE: _close,
    Predicate.KNOWS: _knows,
    Predicate.HAS_ROUTE: lambda memory, view, said: memory.navigator.arrives and _about_goal(memory, said),
    Predicate.RIGHT_WAY: _right_way,
    Predicate.RED: lambda memory, view, said: is_red_ahead(memory.town, view),
    Predicate.SAFE: lambda memory, view, said: (
        view.hazard is ObjectClass.UNLABELED and sees_far(view) and is_localised(view, LOST_VARIANCE)
    ),
    Predicate.DOES: lambda memory, view, said: present_action(view) is said.get("action"),
    Predicate.ARRIVED: lambda memory, view, said: (
        bool(memory.value("arrived")) and view.standing and _about_goal(memory, said)
    ),
    Predicate.STANDS: lambda memory, view, said: view.standing,
    Predicate.LOCALISED: lambda memory, view, said: is_localised(view, LOST_VARIANCE),
    Predicate.VISIBILITY: lambda memory, view, said: sees_far(view),
    Predicate.FAILED: _failed,
    Predicate.LIGHTS_ON: lambda memory, view, said: view.lights,
    Predicate.GOAL: _has_goal,
    Predicate.BLOCKED: _blocked,
    Predicate.CROWDED: _crowded,
    Predicate.HINDERS: lambda memory, view, said: view.motion is Motion.HAZARD and view.hazard is said.get("object"),
}
