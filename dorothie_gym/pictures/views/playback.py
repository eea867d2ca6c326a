"""Playback of recorded sessions, native or imported, as scenes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.archive.actor_tracks import ActorTracks
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_landmark
from dorothie_gym.pictures.views.exception_words import exception_words
from dorothie_gym.pictures.views.scene import (
    Actor,
    CarView,
    ExceptionMark,
    FigureKind,
    Pin,
    Scene,
    SpokenLine,
    SubgoalState,
)
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.session.recording.street_titles import recorded_labels, recorded_titles
from dorothie_gym.session.recording.surroundings import ActorKind
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.tasks.catalogue import map_labels
from dorothie_gym.tasks.storyboard import with_reason

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.dialogue_acts import DialogueAct
    from dorothie_gym.session.recording.header import LandmarkRow
    from dorothie_gym.session.recording.session import Session

_KINDS: Final[dict[int, FigureKind]] = {
    int(ActorKind.VEHICLE): "vehicle",
    int(ActorKind.CYCLIST): "cyclist",
    int(ActorKind.PEDESTRIAN): "pedestrian",
    int(ActorKind.PROP): "prop",
    int(ActorKind.OTHER): "prop",
}

_STATES: Final[dict[str, SubgoalState]] = {
    "complete": "complete",
    "abandoned": "abandoned",
    "ongoing": "ongoing",
    "pending": "pending",
}

_TRAIL: Final = 0.5
"""Time between two points of the driven path [s]."""


class Playback:
    """Scenes of a session at any frame.

    Attributes:
        first_frame: first frame with a car state; 0 if there is none.

    Args:
        session: recorded session.
        town: town of the session.
    """

    def __init__(self, session: Session, town: Town) -> None:
        self._session, self._town = session, town
        self._lines = _lines(session)
        self._tracks = ActorTracks(session.scene.actors)
        self._labels = map_labels([parse_landmark(row["name"]) for row in session.header.landmarks])
        self._waypoints = [_waypoint(row, town) for row in session.header.landmarks]
        self._exceptions = [
            ExceptionMark(time=event.time, text=exception_words(event.data), x=car.x, y=car.y)
            for event in session.of_type(EventType.EXCEPTION)
            for car in (self._car(event.frame),)
        ]
        rows = session.trajectory
        self.first_frame = int(rows["frame"][0]) if len(rows) else 0
        step = max(round(_TRAIL * FRAME_RATE), 1)
        self._trail_frames = rows["frame"][::step]
        self._trail = np.stack([rows["x"][::step], rows["y"][::step]], axis=1)

    @property
    def last_frame(self) -> int:
        """Last frame with a recorded event or state."""
        return round(self._session.duration * FRAME_RATE)

    def scenes(self, frames_per_second: float) -> Iterator[Scene]:
        """Yields scenes at a frame rate [1/s], from the first frame with a car state to the last."""
        for k in range(self.count(frames_per_second)):
            yield self.scene(self.first_frame + round(k * FRAME_RATE / frames_per_second))

    def count(self, frames_per_second: float) -> int:
        """Returns the number of scenes at a frame rate [1/s]."""
        return math.floor((self.last_frame - self.first_frame) * frames_per_second / FRAME_RATE) + 1

    def scene(self, frame: int) -> Scene:
        """Returns the session at a frame (30 Hz)."""
        header, time = self._session.header, frame / FRAME_RATE
        goals = self._goals(frame)
        states: dict[object, SubgoalState] = {header.subgoals[i]["landmark"]: state for i, (_, state) in goals.items()}
        weather = self._session.scene.weather.at(frame)
        car = self._car(frame)
        driven = int(np.searchsorted(self._trail_frames, frame, side="right"))
        return Scene(
            time=time,
            town=self._town,
            car=car,
            street_names=self._street_names(),
            trail=np.concatenate((self._trail[:driven], [[car.x, car.y]])),
            others=self._others(frame),
            landmarks=[
                Pin(
                    label=label,
                    x=row["x"],
                    y=row["y"],
                    waypoint=waypoint,
                    state=states.get(k, "none"),
                    hidden=row["hidden"],
                )
                for k, (row, label, waypoint) in enumerate(
                    zip(header.landmarks, self._labels, self._waypoints, strict=True)
                )
            ],
            subgoals=list(goals.values()),
            utterances=[line for line in self._lines if line.time <= time],
            speaking=[line for line in self._lines if line.start is not None and line.start <= time < line.time],
            exceptions=[mark for mark in self._exceptions if mark.time <= time],
            notes=self._notes(frame),
            weather={} if weather is None else {name: float(weather[name][0]) for name in weather.dtype.names or ()},
            caption=header.storyboard,
        )

    def _street_names(self) -> list[str] | None:
        """Returns the recorded street names; None if they do not match the town."""
        names = recorded_labels(self._session.header)
        return names if len(names) == len(self._town.streets) else None

    def _car(self, frame: int) -> CarView:
        rows = self._session.trajectory
        if not len(rows):
            lane, station = self._session.header.departure
            known = 0 <= lane < len(self._town.lanes)
            x, y = self._town.lanes[lane].position(station) if known else (0.0, 0.0)
            return CarView(x=float(x), y=float(y), heading=0.0)
        row = rows[max(int(np.searchsorted(rows["frame"], frame, side="right")) - 1, 0)]
        lights = [
            action.up
            for action in self._session.physical_actions
            if action.action is PhysicalAction.LIGHT_CHANGE and action.frame <= frame
        ]
        return CarView(
            x=float(row["x"]),
            y=float(row["y"]),
            heading=float(row["heading"]),
            speed=float(np.nan_to_num(row["speed"])),
            lights=bool(lights and lights[-1]),
        )

    def _others(self, frame: int) -> list[Actor]:
        """Returns the actors at a frame, interpolated between recorded positions."""
        return [_actor(row) for row in self._tracks.actors(self._tracks.at(frame))]

    def _goals(self, frame: int) -> dict[int, tuple[str, SubgoalState]]:
        """Returns description and state of the active subgoals at a frame, by number."""
        subgoals = self._session.header.subgoals
        status_of: dict[int, tuple[str, str]] = {}
        for event in self._session.of_type(EventType.SUBGOAL):
            number = event.data.get("subgoal")
            if event.frame <= frame and isinstance(number, int) and 0 <= number < len(subgoals):
                status_of[number] = str(event.data.get("status", "")).lower(), str(event.data.get("cause", ""))
        reached = {number for number, (status, _) in status_of.items() if status == "complete"}
        goals: dict[int, tuple[str, SubgoalState]] = {}
        for number, row in enumerate(subgoals):
            status, cause = status_of.get(number, ("", ""))
            if row["trigger"] and not status:
                continue
            state = _STATES.get(status, "pending")
            changed = row["change"] if "change" in cause else None
            reason = row.get("extra", {}).get("reason")
            described = with_reason(row["description"], reason if isinstance(reason, str) else None)
            goals[number] = changed or described, state
        live = [number for number, (_, state) in goals.items() if state != "abandoned"]
        for number in live:
            if number not in reached:
                before = live[:-1] if number == live[-1] else [k for k in subgoals[number]["after"] if k in live]
                goals[number] = goals[number][0], "ongoing" if reached.issuperset(before) else "pending"
        return goals

    def _notes(self, frame: int) -> list[str]:
        hazard = ""
        faults: dict[str, bool] = {}
        for event in self._session.of_type(EventType.HAZARD_STOP, EventType.HAZARD_END, EventType.EXCEPTION):
            if event.frame > frame:
                break
            if event.type is EventType.EXCEPTION:
                if "sensor" in event.data:
                    faults[str(event.data["sensor"])] = bool(event.data.get("on"))
            else:
                hazard = str(event.data.get("reason", "")) if event.type is EventType.HAZARD_STOP else ""
        notes = [f"Hazard stop: {hazard}"] if hazard else []
        return notes + [f"Sensor fault: {sensor}" for sensor, on in faults.items() if on]


def _actor(row: np.void) -> Actor:
    return Actor(
        kind=_KINDS[int(row["kind"])],
        x=float(row["x"]),
        y=float(row["y"]),
        heading=float(row["heading"]),
        length=float(row["length"]),
        width=float(row["width"]),
    )


def _waypoint(row: LandmarkRow, town: Town) -> tuple[float, float]:
    """Returns the waypoint of a landmark on its lane, or its position if the lane is unknown."""
    if not 0 <= row["lane"] < len(town.lanes):
        return row["x"], row["y"]
    x, y = town.lanes[row["lane"]].position(row["station"])
    return float(x), float(y)


def _lines(session: Session) -> list[SpokenLine]:
    """Returns all utterances and messages in the order in which they were heard."""
    titles = recorded_titles(session.header)
    lines = [
        SpokenLine(
            time=said.frame / FRAME_RATE,
            speaker=said.speaker,
            text=titles.shown(said.text),
            acts=titles.shown(" ".join(_short(move.act) for move in said.moves)),
            start=said.start,
        )
        for said in session.utterances()
    ]
    lines += [
        SpokenLine(time=event.time, speaker=Role.AD_WIZARD, text=str(event.data.get("text", "")))
        for event in session.of_type(EventType.MESSAGE)
    ]
    return sorted(lines, key=lambda line: line.time)


def _short(act: DialogueAct) -> str:
    return str(act).removesuffix("()")
