"""View of spectators and of the experimenter: the true state of the whole session."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from dorothie_gym.lab.console.pins import Pin, drawn_names, pin_rows
from dorothie_gym.lab.console.views import KMH, RoleView, weather_shares
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.views.exception_words import exception_words
from dorothie_gym.session.recording.events import Event, EventType

if TYPE_CHECKING:
    from dorothie_gym.lab.console.lane_lookup import LaneLookup
    from dorothie_gym.session.live_session import LiveSession
    from dorothie_gym.tasks.storyboard import Landmark


def spectator_view(session: LiveSession, places: LaneLookup) -> RoleView:
    """Returns the view of a spectator: true and estimated pose, all bodies, tasks, weather and faults."""
    world, task = session.world, session.task
    x, y = world.car.position.tolist()
    pose, covariance = world.localizer.pose, world.localizer.covariance
    subgoals = range(len(task.storyboard.subgoals))
    hazard = world.hazard
    return {
        "time": round(world.time, 2),
        "pose": [round(x, 2), round(y, 2), round(float(world.car.heading), 3)],
        "estimate": [round(float(value), 2) for value in pose],
        "covariance": [round(float(covariance[k]), 2) for k in ((0, 0), (1, 1), (0, 1))],
        "speed": round(float(world.car.speed) * KMH, 1),
        "lights": bool(world.ego.lights),
        "hazard": None if hazard is None else [hazard.kind.label, 0],
        "landmarks": [list(row) for row in pin_rows(_pins(task.storyboard.landmarks), _streets(session), places)],
        "hidden": [landmark.hidden for landmark in task.storyboard.landmarks],
        "tasks": [
            {
                "item": i,
                "landmark": task.landmark_of(i),
                "status": task.status(i).label.lower(),
                "text": task.description(i),
                "live": i in task.live,
                "allowed": task.allowed(i),
            }
            for i in subgoals
        ],
        "guesses": [
            [name.label, *place.mean, place.covariance[0][0], place.covariance[1][1], place.covariance[0][1]]
            for name, place in session.beliefs.places.items()
        ],
        "goals": [name.label for name in session.beliefs.goals],
        "path": [
            [round(float(value), 1) for value in world.planner.path.position_at(station)]
            for station in _stations(world.planner.s, world.planner.path.length)
        ],
        "objects": _bodies(session),
        "weather": weather_shares(world.weather.values),
        "faults": [sensor.value for sensor in world.faults],
    }


def _streets(session: LiveSession) -> list[str]:
    """Returns the name of each street on the map; empty for streets without one."""
    return session.scenario.titles.labels(drawn_names(session.scenario.street_names))


def _pins(landmarks: Sequence[Landmark]) -> list[Pin]:
    return [Pin(each.name, each.position, each.lane, each.station, each.street) for each in landmarks]


def event_rows(events: tuple[Event, ...]) -> list[RoleView]:
    """Returns events in JSON types and in words, without dialogue moves, which are shown as talk."""
    return [
        {"t": round(event.time, 1), "type": event.type.value, "role": event.source.value, "text": _words(event)}
        for event in events
        if event.type is not EventType.DIALOGUE_MOVE
    ]


def _words(event: Event) -> str:
    if event.type is EventType.EXCEPTION:
        return exception_words(event.data)
    details = [(name, value) for name, value in event.data.items() if isinstance(value, str | int | float)]
    return ", ".join(f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}" for name, value in details)


def _stations(start: float, length: float) -> list[float]:
    return [start + step for step in range(0, 100, 5) if start + step < length]


def _bodies(session: LiveSession) -> list[list[object]]:
    actors = session.world.actors
    found = [_body(ObjectClass.VEHICLES.label, body, body.heading) for body in actors.vehicles]
    found += [_body(ObjectClass.PEDESTRIAN.label, body, 0.0) for body in actors.pedestrians]
    return found + [_body(prop.kind.value, prop, prop.heading) for prop in actors.props]


def _body(label: str, body: Any, heading: float) -> list[object]:
    """Returns label, x, y [m], heading [rad], length and width [m] of a body."""
    x, y = body.position
    numbers = ((x, 1), (y, 1), (heading, 2), (body.LENGTH, 1), (body.WIDTH, 1))
    return [label, *(round(float(value), digits) for value, digits in numbers)]
