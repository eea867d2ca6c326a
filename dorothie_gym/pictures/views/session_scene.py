"""Scene of a session in progress for the renderer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.pictures.views.exception_words import exception_words
from dorothie_gym.pictures.views.scene import (
    SUBGOAL_STATES,
    Actor,
    CarView,
    ExceptionMark,
    Pin,
    Scene,
    SpokenLine,
    SubgoalState,
)

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Utterance
    from dorothie_gym.session.live_session import LiveSession


def utterances_of(session: LiveSession) -> list[SpokenLine]:
    """Returns the finished utterances and the messages of the Ad-Wizard, by the time at which they were heard."""
    lines = [_line(utterance, session) for utterance in session.dialogue.said]
    lines += [SpokenLine(time=time, speaker=Role.AD_WIZARD, text=text) for time, text in session.messages]
    return sorted(lines, key=lambda line: line.time)


def _line(utterance: Utterance, session: LiveSession) -> SpokenLine:
    rate, titles = session.config.decision_frequency, session.scenario.titles
    return SpokenLine(
        time=math.ceil(utterance.end * rate - 1e-6) / rate,  # the decision at which it is delivered
        speaker=utterance.speaker,
        text=titles.shown(utterance.text),
        acts=titles.shown(" ".join(str(act).removesuffix("()") for act in utterance.acts)),
        start=utterance.start,
    )


def scene_of(session: LiveSession, caption: str = "", heard: Sequence[SpokenLine] = ()) -> Scene:
    """Returns the scene of a session at the current decision.

    Args:
        session: the session.
        caption: title of the picture; by default the name of the storyboard.
        heard: instructions that are not utterances of the session.
    """
    world, task = session.world, session.task
    car, planner = world.car, world.planner
    states: dict[int, SubgoalState] = {}
    for i in range(len(task.storyboard.subgoals)):
        if i in task.live or task.status(i) is GoalStatus.ABANDONED:
            states.setdefault(task.landmark_of(i), SUBGOAL_STATES[task.status(i)])
    stations = np.arange(planner.s + 5.0, min(planner.s + 100.0, planner.path.length), 5.0)
    others = [Actor(kind="vehicle", x=v.position[0], y=v.position[1], heading=v.heading) for v in world.actors.vehicles]
    for pedestrian in world.actors.pedestrians:
        x, y = pedestrian.position
        others.append(Actor(kind="pedestrian", x=x, y=y, heading=pedestrian.heading, length=0.6, width=0.6))
    for prop in world.actors.props:
        x, y = prop.position
        others.append(Actor(kind="prop", x=x, y=y, heading=prop.heading, length=prop.LENGTH, width=prop.WIDTH))
    notes = []
    if world.hazard is not None:
        notes.append(f"Hazard stop: {world.hazard.kind.label}")
    notes += [f"Sensor fault: {sensor}" for sensor in world.faults]
    return Scene(
        time=world.time,
        town=world.town,
        car=CarView(
            x=float(car.position[0]),
            y=float(car.position[1]),
            heading=float(car.heading),
            speed=float(car.speed),
            lights=world.ego.lights,
        ),
        street_names=session.scenario.street_labels,
        trail=np.array(session.trail),
        waypoints=np.array([planner.path.position_at(float(s)) for s in stations]).reshape(-1, 2),
        others=others,
        landmarks=[
            Pin(
                label=landmark.label,
                x=landmark.position[0],
                y=landmark.position[1],
                waypoint=landmark.waypoint,
                state=states.get(landmark.index, "none"),
                hidden=landmark.hidden,
            )
            for landmark in task.storyboard.landmarks
        ],
        subgoals=[
            (task.description(i), SUBGOAL_STATES[status])
            for i, status in enumerate(map(task.status, range(len(task.storyboard.subgoals))))
            if i in task.live or status is GoalStatus.ABANDONED
        ],
        exceptions=[
            ExceptionMark(time=time, text=exception_words(data), x=x, y=y) for time, (x, y), data in session.exceptions
        ],
        utterances=sorted((*utterances_of(session), *heard), key=lambda line: line.time),
        speaking=[_line(utterance, session) for utterance in session.dialogue.in_progress],
        notes=notes,
        weather={str(parameter): value for parameter, value in world.weather.values.items()},
        caption=caption or task.storyboard.name,
    )
