"""Session in which only driving is left to the agent, and the base class of the navigation environments."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar, TypeVar, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import direct
from dorothie_gym.compilation.records import plain
from dorothie_gym.copying import Lookups, Restorable
from dorothie_gym.engine.observations import LazyObservations
from dorothie_gym.engine.scenario import (
    ResetOptions,
    Scenario,
    check_options,
    draw_scenario,
    scenario_option,
    template_option,
)
from dorothie_gym.engine.session_engine import LiveSession
from dorothie_gym.envs.episode import TERMS, Ending, episode_arrays, judge
from dorothie_gym.envs.interference import Interference
from dorothie_gym.envs.navigation_config import NavigationConfig
from dorothie_gym.envs.session_view import SessionView, metadata_at
from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import LandmarkName, MentalAction, Role, StreetName
from dorothie_gym.policies.navigation.actions import ACTIONS
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.driver_view import driver_arrays
from dorothie_gym.policies.navigation.instructor import Guidance, Instructor, NavigationInstruction, words_of
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, exit_arrays
from dorothie_gym.policies.navigation.observation_vector import FIELDS, HeardInstruction, Vector, observe
from dorothie_gym.policies.observation_parser import SeenLandmark
from dorothie_gym.sim.network.network import TownNetwork, network_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.spaces import (
    AdWizardAction,
    CoWizardAction,
    LanePosition,
    Mental,
    Observation,
    ParticipantAction,
    RoleAction,
    SpaceLimits,
    StepInfo,
)
from dorothie_gym.tasks import Landmark, StoryboardTemplate
from dorothie_gym.time_limit import TimeLimitedEnv, decisions_in

_SILENCE, _INTACT = ParticipantAction(), AdWizardAction()

_judge, _observe = direct(judge), direct(observe)


class DrivingSession(Lookups):
    """Session in progress in which the agent only drives: instructor, Ad-Wizard, rewards and end of the episode.

    Attributes:
        session: the session.
        exits: exits of the town's junctions.
        instructor: built-in participant.
        seen: present observations of the roles, each built when it is read.
        driver: what the driver knows at the present decision, its observation and its mask.
        episode: rewards of the episode.
        ending: reason for its end.
    """

    LOOKED_UP: ClassVar[Sequence[str]] = ("_state", "_inputs", "_record")

    def __init__(self, session: LiveSession, config: NavigationConfig, exits: JunctionExits) -> None:
        self.session, self.exits, self._config = session, exits, config
        town, scenario, limits = session.world.town, session.scenario, session.limits
        streets = [name.value for name in scenario.street_names]
        landmarks = scenario.storyboard.landmarks[: limits.landmarks]
        self._known = frozenset((mark.lane, mark.station) for mark in landmarks if not mark.hidden)
        self.instructor = Instructor(
            town, Guidance(config.guidance), [_seen(mark, row, town, streets) for row, mark in enumerate(landmarks)],
            self._known, streets, subgoals=len(scenario.storyboard.subgoals), things=limits.objects,
        )  # fmt: skip
        self.driver = driver_arrays(sum(FIELDS.values()), len(ACTIONS), streets)
        self._town_arrays, self._exit_arrays = town_arrays(session.world.network), exit_arrays(town)
        self._cost_to_named = CostToGo(town)
        self._interference = Interference(session, config.exceptions) if config.exceptions > 0.0 else None
        self._driven, self._named, self._notes = 0.0, cast("Place | None", None), list[Mental]()
        self._aim: tuple[Place | None, tuple[Place, ...]] = (None, ())  # goal and roadblocks of the last decision
        self._weather: tuple[float, ...] = ()
        self.seen: Mapping[str, Observation] = LazyObservations(session)
        self.episode, self._task_version, self.ending = episode_arrays(config), -1, Ending.NONE
        self._note_task()
        self._listen()
        self._note_aim()
        self._state["left"], self._state["counted"] = self._cost_to_go(), self._state["reached"]

    @classmethod
    def begin(
        cls, town: Town, network: TownNetwork, template: StoryboardTemplate | None, config: NavigationConfig,
        seed: int, scenario: Scenario | None = None,
    ) -> DrivingSession:  # fmt: skip
        """Begins a session.

        Args:
            town: the map.
            network: its lanes.
            template: template of the storyboard; None draws one.
            config: settings.
            seed: seed of the scenario.
            scenario: scenario to play instead of a drawn one.
        """
        if scenario is None:
            scenario = draw_scenario(town, template, seed)
        limits = SpaceLimits.for_town(town)
        return cls(LiveSession(town, network, scenario, config.session_config, limits), config, JunctionExits(town))

    # --- a decision -------------------------------------------------------------------------------------------------

    def play(self, action: CoWizardAction) -> None:
        """Plays one decision; the next belief update of the Co-Wizard is sent with its action."""
        if self.ending:
            from gymnasium.error import ResetNeeded

            raise ResetNeeded("the session is over: call reset() first")
        if self._notes:
            action = replace(action, mental=self._notes.pop(0))
        session, world, state = self.session, self.session.world, self._state
        before, speed = world.time, float(world.car.speed)
        session.step({Role.PARTICIPANT: _SILENCE, Role.CO_WIZARD: action, Role.AD_WIZARD: self.interfere()})
        self.seen = LazyObservations(session)
        self._driven += (world.time - before) * (speed + float(world.car.speed)) / 2.0
        last, left = float(state["left"]), self._cost_to_go()  # to the goal of the last decision
        state["progress"] = last - left if math.isfinite(left) and math.isfinite(last) else 0.0
        self._note_task()
        self._listen()
        self._note_aim()
        state["left"] = self._cost_to_go()
        state["acted"] = action.physical is not None
        state["refusals"] = len(session.refused[Role.CO_WIZARD])
        _judge(world.actors.arrays, self.episode)
        self.ending = Ending(int(state["ending"]))
        if self.ending:
            session.end(self.ending.label)

    def observe_roles(self) -> None:
        """Builds the observations that are read before the next decision, before the planned path changes."""
        for role in (Role.CO_WIZARD,) if self._is_idle else (Role.CO_WIZARD, Role.AD_WIZARD):
            self.seen[role]

    def observe(self) -> Vector:
        """Looks, and returns the observation of the driver; its view and mask are in `driver`."""
        world, driver, named = self.session.world, self.driver, self._named
        weather = tuple(world.weather.values.values())
        if weather != self._weather:
            self._weather = self._inputs["weather"] = weather
        self._record["driven"] = self._driven
        self._cost_to_named.aim(named, self.instructor.blocked if named is not None else ())
        _observe(
            self._town_arrays, self._exit_arrays, world.sensing_arrays, driver, *self._cost_to_named.rows,
            self._config.max_seconds,
        )  # fmt: skip
        return driver.vector.copy()

    def info(self) -> StepInfo:
        """Returns the info of the last decision, as a new dictionary."""
        info: StepInfo = {
            "reward_terms": self.terms,
            "refused": list(self.session.refused[Role.CO_WIZARD]),
            "infractions": dict(self.session.infractions),
        }
        if self.ending:
            info["is_success"], info["reason"] = self.session.success, self.ending.label
            info["subgoals"] = {"live": len(self.session.task.live), "reached": int(self._state["reached"])}
        return info

    # --- other roles -------------------------------------------------------------------------------------------------

    def interfere(self) -> RoleAction:
        """Returns the present action of the Ad-Wizard."""
        interference = self._interference
        if interference is None:
            return _INTACT
        if self._is_idle:
            interference.wait()
            return _INTACT
        return interference.act(self.seen)

    @property
    def _is_idle(self) -> bool:
        """Whether the Ad-Wizard does nothing at this decision."""
        return self._interference is None or self.session.world.time < self._interference.due

    def _listen(self) -> None:
        """Lets the instructor speak, and updates the goal."""
        self.instructor.look(self.session.world.sensing_arrays)
        goal, said = self.instructor.goal, self.instructor.instruct()
        if self.instructor.goal is not goal:
            self._named = None
            self._notes = [Mental(action=MentalAction.GOAL_UPDATE)]
        if said is not None:
            self._driven = 0.0
            if said.landmark is not None:
                self._note_goal(said.landmark, said.distance, by_name=said.action is None)
        if said is not None or self.instructor.goal is not goal:
            self.heard.write(self.exits.town, self.driver)

    @property
    def heard(self) -> HeardInstruction:
        """Last instruction, as the Co-Wizard remembers it."""
        return HeardInstruction(instruction=self.instructor.instruction, driven=self._driven, goal=self._named)

    def _note_goal(self, name: LandmarkName, distance: float, *, by_name: bool) -> None:
        """Queues the belief updates for a goal: a place on the map, or one as far ahead as was said."""
        goal = self.instructor.goal
        assert goal is not None
        self._notes = [Mental(action=MentalAction.GOAL_UPDATE, goals=(name,))]
        if by_name:
            self._named = goal.place
        elif goal.place not in self._known:
            path, s = self.session.world.planner.path, self.session.world.planner.s
            k = path.index_at(min(s + distance, path.length))
            lane, station = int(path.lanes[k]), float(path.stations[k])
            mark = LanePosition(lane=lane, metres=int(station))
            self._notes.append(Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=name, place=mark))

    # --- progress and reward ------------------------------------------------------------------------------------------

    def _cost_to_go(self) -> float:
        planner = self.session.world.planner
        return self.instructor.cost_to_go.from_place(planner.lane, planner.station)

    def _note_task(self) -> None:
        """Notes the state of the task after a change."""
        task, state = self.session.task, self._state
        if task.version != self._task_version:
            self._task_version = task.version
            state["reached"] = sum(task.reached(i) for i in task.live)
            state["done"], state["succeeded"] = task.done, task.success
            self.instructor.note_subgoals(
                (task.landmark_of(i), i in task.live and not task.reached(i), task.allowed(i))
                for i in range(len(task.storyboard.subgoals))
            )

    def _note_aim(self) -> None:
        """Notes whether the goal or the known roadblocks have changed."""
        way = self.instructor.cost_to_go
        aim = way.goal, way.blocked
        if aim != self._aim:
            self._aim, self._state["renewed"] = aim, True

    @cached_property
    def _state(self) -> np.void:
        """Record of the episode."""
        state: np.void = plain(self.episode.state)[0]
        return state

    @cached_property
    def _inputs(self) -> np.void:
        """View of the driver."""
        inputs: np.void = plain(self.driver.inputs)[0]
        return inputs

    @cached_property
    def _record(self) -> np.void:
        """Last instruction in the arrays of the driver."""
        record: np.void = plain(self.driver.heard)[0]
        return record

    @property
    def reward(self) -> float:
        """Reward of the last decision."""
        return float(self._state["reward"])

    @property
    def terms(self) -> dict[str, float]:
        """Terms of the reward, by name."""
        return dict(zip(TERMS, self._state["terms"].tolist(), strict=True))

    @property
    def truncated(self) -> bool:
        """Whether time is up."""
        return self.ending is Ending.OUT_OF_TIME

    @property
    def terminated(self) -> bool:
        """Whether the destination was reached, the ego has left the road, or the participant gave up."""
        return self.ending not in (Ending.NONE, Ending.OUT_OF_TIME)


def _seen(mark: Landmark, row: int, town: Town, streets: Sequence[int]) -> SeenLandmark:
    """Returns a landmark as the participant observes it; `streets` has the ids of the streets' names."""
    street, (x, y) = town.lanes[mark.lane].street, mark.position
    name = StreetName(streets[street]) if 0 <= street < len(streets) else StreetName.UNKNOWN
    return SeenLandmark(row=row, name=mark.name, x=x, y=y, lane=mark.lane, station=float(mark.station), street=name)


Action = TypeVar("Action")


class DrivingEnv(Restorable, TimeLimitedEnv[Vector, Action]):
    """Base class of the navigation environments; subclasses define observations and actions."""

    CHANGES: ClassVar[Sequence[str]] = ("_drive", "_shown", "_np_random", "_np_random_seed")

    def __init__(
        self, town: str | Path | Town, storyboard: str | Path | StoryboardTemplate | None, config: NavigationConfig,
        render_mode: str | None, view: str,
    ) -> None:  # fmt: skip
        self.config = config
        self.metadata = metadata_at(config.decision_frequency)
        self.render_mode = render_mode
        self._view = SessionView.of_role(Role.CO_WIZARD, view, render_mode, config.decision_frequency)
        self._shown: NavigationInstruction | None = None
        self.town = town if isinstance(town, Town) else load_town(town)
        self.template = template_option(storyboard)
        self._network = network_of(self.town)
        self._drive: DrivingSession | None = None

    def mutable_values(self) -> dict[str, object]:
        """Returns what changes in the environment, and what was noted for its pictures."""
        return {**super().mutable_values(), "view": self._view.notes}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environment and the notes for its pictures."""
        notes = values.pop("view")
        super().apply_values(values)
        if self._drive is not None:
            self._view.apply_values(notes, self._drive.session)

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, the town and the settings."""
        return {**super().compatibility(), "the town": self.town, "the settings": self.config}

    @property
    def decision_limit(self) -> int:
        """Decisions until truncation."""
        return decisions_in(self.config.max_seconds, self.config.decision_frequency)

    @property
    def drive(self) -> DrivingSession:
        """Session in progress; raises `gymnasium.error.ResetNeeded` before the first reset."""
        if self._drive is None:
            raise gym.error.ResetNeeded("no session is being played: call reset() first")
        return self._drive

    def begin(self, seed: int | None, options: ResetOptions | None) -> DrivingSession:
        """Begins a session, see `reset`."""
        super().reset(seed=seed)
        check_options(options, "scenario")
        session = seed if seed is not None else int(self.np_random.integers(2**31))
        self._drive = DrivingSession.begin(
            self.town, self._network, self.template, self.config, session, scenario_option(options)
        )
        self._view.begin(self._drive.session)
        self.show()
        return self._drive

    def show(self) -> None:
        """Notes the present decision for `render()`, and draws it in human mode."""
        if self.render_mode is None:
            return
        drive = self.drive
        instruction = drive.heard.instruction
        if instruction is not None and instruction is not self._shown:
            self._view.note_instruction(instruction.time, words_of(instruction), str(instruction.act))
        self._shown = instruction
        self._view.note(drive.seen[Role.CO_WIZARD])
        if self.render_mode == "human":
            self.render()

    def render(self) -> NDArray[np.uint8] | None:
        """Draws what the Co-Wizard observes, or the session (see `view`), as `DuoWizardEnv.render`.

        The instructions of the participant are part of the picture.
        """
        return self._view.render(self.drive.session)

    def close(self) -> None:
        """Closes the window, if there is one."""
        self._view.close()
