"""Recorder of a session in progress: events, frames, actions and surroundings, decision by decision."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.actor_table import actors_around
from dorothie_gym.session.recording.writer import Scene
from dorothie_gym.session.spaces.actions import ActionDict, AnyAction, action_space, encoded, is_idle, noop
from dorothie_gym.support.audio import encode_flac

if TYPE_CHECKING:
    from dorothie_gym.maps.town import LightColour, Town
    from dorothie_gym.session.recording.action_log import Decision
    from dorothie_gym.session.recording.events import Event
    from dorothie_gym.session.recording.writer import SessionWriter
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.fields import SpaceLimits


class LightStates:
    """Colours of the traffic lights of a town, computed again only after a change.

    Args:
        town: the town.
    """

    def __init__(self, town: Town) -> None:
        self._programmes = [(programme, -math.inf, -math.inf) for programme in town.programmes]
        self._since = self._until = -math.inf
        self._states: dict[int, LightColour] = {}

    def at(self, time: float) -> dict[int, LightColour]:
        """Returns the colours at a simulated time [s] by id of the signal; the caller must not modify them.

        It is the same object as long as no light of the town changes.
        """
        if not self._since <= time < self._until:
            self._update(time)
        return self._states

    def _update(self, time: float) -> None:
        """Looks up the programmes whose phase may be another one at a time."""
        changed: dict[int, LightColour] = {}
        for number, (programme, since, until) in enumerate(self._programmes):
            if not since <= time < until:
                self._programmes[number] = programme, time, programme.change_after(time)
                phase = programme.phase_at(time)
                changed |= {signal: phase.colour(signal) for signal in programme.signals}
        if any(self._states.get(signal) is not colour for signal, colour in changed.items()):
            self._states = self._states | changed
        self._since = max((since for _, since, _ in self._programmes), default=time)
        self._until = min((until for *_, until in self._programmes), default=math.inf)


# --- compact actions --------------------------------------------------------------------------------------------------


@lru_cache(maxsize=16)
def _idle(role: Role, limits: SpaceLimits) -> ActionDict:
    return noop(role, limits)


@lru_cache(maxsize=16)
def _arrays(role: Role, limits: SpaceLimits) -> frozenset[str]:
    return frozenset(name for name, value in _idle(role, limits).items() if isinstance(value, np.ndarray))


def compact(actions: Mapping[str, AnyAction], limits: SpaceLimits) -> dict[Role, ActionDict]:
    """Returns actions in the compact form of `Decision`: fields without effect are left out.

    Args:
        actions: valid actions of the roles, by agent.
        limits: sizes of the action spaces.
    """
    found = {}
    for role in AGENT_ROLES:
        action = actions[str(role)]
        if is_idle(action):
            continue
        idle, arrays = _idle(role, limits), _arrays(role, limits)
        fields: ActionDict = {}
        for name, value in encoded(action, limits).items():
            if name in arrays:
                values = np.asarray(value)
                if values.any():
                    fields[name] = _short(values, _is_flags(role, name, limits))
            elif value != idle[name]:
                fields[name] = value if isinstance(value, str) else int(value)
        if fields:
            found[role] = fields
    return found


def expand(decision: Decision, limits: SpaceLimits) -> dict[str, ActionDict]:
    """Returns the actions of a recorded decision in the action spaces, by agent.

    Raises:
        SessionError: a role has no such field, or a value is outside its range.
    """
    return {str(role): _expanded(decision, role, limits) for role in AGENT_ROLES}


def idle_actions(limits: SpaceLimits) -> dict[str, ActionDict]:
    """Returns the actions without effect of all roles, by agent."""
    return {str(role): _idle(role, limits) for role in AGENT_ROLES}


def _short(values: NDArray[np.generic], flags: bool) -> list[int]:
    places = np.flatnonzero(values)
    short: list[int] = places.tolist() if flags else values[: int(places[-1]) + 1].tolist()
    return short


def _expanded(decision: Decision, role: Role, limits: SpaceLimits) -> ActionDict:
    idle = _idle(role, limits)
    fields = decision.actions.get(role)
    if not fields:
        return idle
    action = dict(idle)
    for name, value in fields.items():
        where = f"decision at frame {decision.frame}, {role}: field {name!r}"
        if name not in idle:
            raise SessionError(f"{where} is none of {', '.join(idle)}")
        if isinstance(idle[name], np.ndarray):
            value = _long(value, idle[name], _is_flags(role, name, limits), where)
        action[name] = value
    return action


def _long(value: object, idle: NDArray[np.generic], flags: bool, where: str) -> NDArray[np.generic]:
    array = idle.copy()
    if not isinstance(value, list | tuple) or not all(type(item) is int and 0 <= item < 2**31 for item in value):
        raise SessionError(f"{where} must be a list of whole numbers")
    if (max(value, default=0) if flags else len(value) - 1) >= len(array):
        raise SessionError(f"{where} goes beyond the {len(array)} places that there are")
    if flags:
        array[list(value)] = 1
    else:
        array[: len(value)] = value
    return array


@lru_cache(maxsize=256)
def _is_flags(role: Role, name: str, limits: SpaceLimits) -> bool:
    """Returns whether the field is an array of 0 and 1."""
    return isinstance(action_space(role, limits)[name], spaces.MultiBinary)


# --- recorder ---------------------------------------------------------------------------------------------------------


class SessionRecorder:
    """Records the actions of the roles, the events and frames that follow, and the surroundings at each decision.

    Args:
        engine: an engine that has just been reset; the events of the reset are recorded at once.
        writer: writer of the session's folder.
    """

    def __init__(self, engine: SessionEngine, writer: SessionWriter) -> None:
        self._engine, self._writer = engine, writer
        self._lights = LightStates(engine.town)
        self._frame = engine.session.world.frame
        self._append()

    def record(self, actions: Mapping[str, AnyAction], events: Sequence[Event] | None = None) -> None:
        """Records a decision after the engine has played it.

        Args:
            actions: actions that were played, by agent.
            events: events of the decision, with data known only to the caller; None: those of the engine.

        Raises:
            SessionError: a value cannot be written.
            OSError: the folder cannot be written.
        """
        self._writer.add_decision(self._frame, compact(actions, self._engine.limits))
        self._append(events)

    def record_end(self) -> None:
        """Records the end of a session that was broken off after the last decision; errors as in `record`."""
        self._writer.append(self._engine.last_events)

    def _append(self, events: Sequence[Event] | None = None) -> None:
        frames, world = self._engine.last_frames, self._engine.session.world
        self._frame = world.frame
        happened, check = (self._engine.last_events, False) if events is None else (events, True)
        if len(frames) and frames[-1, 0] == world.frame:
            scene = Scene(actors_around(world), self._lights.at(world.time), world.weather.values)
            self._writer.append(happened, frames, scene, check=check)
        else:
            self._writer.append(happened, frames, check=check)
        if recordings := self._engine.last_recordings:
            for name, samples in recordings.items():
                self._writer.add_audio(name, encode_flac(samples))
