"""Scene of a session in progress for the renderer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.engine.session_engine import LiveSession
from dorothie_gym.ontology import GoalStatus, Role
from dorothie_gym.rendering.frames import HumanWindow, SceneRenderer
from dorothie_gym.rendering.scene import Actor, CarView, Pin, Scene, SpokenLine, SubgoalState

_STATES: dict[GoalStatus, SubgoalState] = {
    GoalStatus.COMPLETE: "complete",
    GoalStatus.ONGOING: "ongoing",
    GoalStatus.PENDING: "pending",
    GoalStatus.ABANDONED: "abandoned",
}


def scene_of(session: LiveSession, caption: str = "") -> Scene:
    """Returns the scene of a session at the present decision.

    Args:
        session: the session.
        caption: title of the picture; by default the name of the storyboard.
    """
    world, task = session.world, session.task
    car, planner = world.car, world.planner
    states: dict[int, SubgoalState] = {}
    for i in range(len(task.storyboard.subgoals)):
        if i in task.live:
            states[task.landmark_of(i)] = _STATES[task.status(i)]
    stations = np.arange(planner.s + 5.0, min(planner.s + 100.0, planner.path.length), 5.0)
    others = [Actor(kind="vehicle", x=v.position[0], y=v.position[1], heading=v.heading) for v in world.actors.vehicles]
    for pedestrian in world.actors.pedestrians:
        x, y = pedestrian.position
        others.append(Actor(kind="pedestrian", x=x, y=y, heading=pedestrian.heading, length=0.6, width=0.6))
    for prop in world.actors.props:
        x, y = prop.position
        others.append(Actor(kind="prop", x=x, y=y, heading=prop.heading, length=prop.LENGTH, width=prop.WIDTH))
    lines = [
        SpokenLine(
            time=u.start, speaker=u.speaker, text=u.text, acts=" ".join(str(act).removesuffix("()") for act in u.acts)
        )
        for u in session.said
    ]
    lines += [SpokenLine(time=time, speaker=Role.AD_WIZARD, text=text) for time, text in session.messages]
    lines.sort(key=lambda line: line.time)
    notes = []
    if world.hazard is not None:
        notes.append(f"Hazard stop: {world.hazard.kind.label}")
    notes += [f"Sensor fault: {sensor}" for sensor in world.faults]
    return Scene(
        time=world.time,
        town=world.town,
        car=CarView(
            x=float(car.position[0]), y=float(car.position[1]), heading=float(car.heading), speed=float(car.speed),
            lights=world.ego.lights,
        ),
        street_names=[name.label for name in session.scenario.street_names],
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
        subgoals=[(task.description(i), _STATES[task.status(i)]) for i in task.live],
        utterances=lines,
        notes=notes,
        weather={str(parameter): value for parameter, value in world.weather.values.items()},
        caption=caption or task.storyboard.name,
    )  # fmt: skip


class SessionRenderer:
    """Draws a session in progress into an array or a window.

    Args:
        human: whether frames are shown in a window.
    """

    def __init__(self, *, human: bool) -> None:
        self._renderer = SceneRenderer()
        self._human = human
        self._window: HumanWindow | None = None

    def draw(self, session: LiveSession, *, follow: bool = True) -> NDArray[np.uint8] | None:
        """Returns a frame (h, w, 3), or shows it in the window and returns None.

        Args:
            session: the session.
            follow: whether the view is centred on the ego.
        """
        frame = self._renderer.draw(scene_of(session), follow=follow)
        if not self._human:
            return frame
        if self._window is None:
            height, width, _ = frame.shape
            self._window = HumanWindow((width, height), "dorothie_gym")
        self._window.show(frame)
        return None

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None
