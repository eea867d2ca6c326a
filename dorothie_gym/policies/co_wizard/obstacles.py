"""Obstacles across the road: seen, told, and driven round."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.dialogue import Wording
from dorothie_gym.ontology import ActionValue, DialogueMove, ObjectClass, SlotValue
from dorothie_gym.policies.co_wizard.goals import plan_way
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import SeenObject, place_on_lanes
from dorothie_gym.policies.route_progress import first_new_street, lanes_ahead
from dorothie_gym.policies.speech import remark
from dorothie_gym.spaces import Motion

SIGHT = 70.0
"""An obstacle is noticed when it is this near [m]."""

ON_PATH = 1.8
"""An obstacle closer than this to the waypoints is on the path [m]."""

NAMES_STREET = 0.65
"""Chance that it proposes a way round by the name of its street."""

WAIT = 6.0
"""So long an answer about a way round is waited for [s]."""


def watch_road(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Looks for obstacles on the path, tells of a new one, and goes round it."""
    if mind.detour_at is not None and view.time - mind.detour_at > WAIT:
        detour(mind, view, rng)
    thing = _on_path(view)
    if thing is None or view.manoeuvring:
        return
    lanes = lanes_ahead(mind.town, view.lane, view.station, SIGHT)
    if mind.journey is not None:
        lanes = (*lanes, *(leg.lane for leg in mind.journey.legs[:5] if leg.lane not in lanes))
    place = place_on_lanes(mind.town, lanes, thing.x, thing.y, width=2.2)
    if place is None or any(other[0] == place[0] and abs(other[1] - place[1]) < 10.0 for other in mind.blocked):
        return
    length = mind.town.lanes[place[0]].length
    # the cell behind the obstacle as well: the car's own cell counts as free
    mind.blocked = (*mind.blocked, place, (place[0], min(place[1] + 8.0, length)))
    mind.hazard_told = view.time
    mind.directive, mind.nudge = None, None
    mind.voice = mind.voice.cleared().plan(
        remark(DialogueMove.EXPLAIN, ObjectClass.STATIC, wording=Wording(topic="blocked"), urgent=True)
    )
    if mind.journey is not None:
        mind.detour_at = view.time
        values = _way_round(mind, view, rng)
        question = remark(DialogueMove.QUERY_YN, *values, wording=Wording(topic="detour"), joined=True)
        mind.voice = mind.voice.plan(question)
    else:
        mind.asked_at = view.time
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, ActionValue.QUERIED, joined=True))
    mind.halted = True


def _way_round(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> tuple[SlotValue, ...]:
    """What it proposes: a street, turning round, or just some other way."""
    assert mind.journey is not None
    way = mind.journey.replanned(mind.town, view.here, mind.blocked)
    street = first_new_street(view.raw, mind.town, view.lane, way)
    if street is not None and rng.random() < NAMES_STREET:
        return (street,)
    return (ActionValue.U_TURN,) if way.turns_round_first(mind.town, view.station) and rng.random() < 0.5 else ()


def _on_path(view: CoWizardView) -> SeenObject | None:
    """The nearest obstacle on the planned waypoints."""
    for thing in view.objects:
        if thing.kind is not ObjectClass.STATIC or thing.distance > SIGHT:
            continue
        if _gap(view.waypoints, thing) < ON_PATH:
            return thing
        if view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC:
            return thing
    return None


def _gap(waypoints: np.ndarray, thing: SeenObject) -> float:
    """Distance of an obstacle from the line through the waypoints [m]."""
    if len(waypoints) < 2:
        return math.inf
    begin, step = waypoints[:-1], np.diff(waypoints, axis=0)  # (n - 1, 2)
    offset = np.array([thing.x, thing.y]) - begin
    share = np.einsum("ij,ij->i", offset, step) / np.maximum(np.einsum("ij,ij->i", step, step), 1e-9)
    return float(np.hypot(*(offset - np.clip(share, 0.0, 1.0)[:, None] * step).T).min())


def detour(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Takes another way, and says which."""
    mind.detour_at, mind.halted = None, False
    plan_way(mind, view)
    if mind.journey is None or mind.journey.route is None:
        return
    street = first_new_street(view.raw, mind.town, view.lane, mind.journey)
    if street is not None:
        mind.voice = mind.voice.plan(remark(DialogueMove.CONFIRM, street, wording=Wording(topic="detour")))
    if mind.journey.turns_round_first(mind.town, view.station) and rng.random() < 0.6:
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, ActionValue.U_TURN, joined=street is not None))
