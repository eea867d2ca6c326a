"""Session in which only driving is left to the agent, and the base class of the navigation environments."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

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
from dorothie_gym.envs.navigation_config import NavigationConfig
from dorothie_gym.envs.session_view import SessionView, metadata_at
from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import LandmarkName, MentalAction, Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard, idle_until
from dorothie_gym.policies.navigation.actions import ACTIONS
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.driver_view import driver_arrays
from dorothie_gym.policies.navigation.instructor import Guidance, Instructor, NavigationInstruction, words_of
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, exit_arrays
from dorothie_gym.policies.navigation.observation_vector import FIELDS, HeardInstruction, Vector, observe
from dorothie_gym.policies.observation_parser import read_landmarks
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.network.network import TownNetwork, network_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.spaces import (
    ActionDecoder,
    AdWizardAction,
    CoWizardAction,
    LanePosition,
    Mental,
    Observation,
    ParticipantAction,
    RoleAction,
    SpaceLimits,
    StepInfo,
    plain_text,
)
from dorothie_gym.spaces.limits import STORY_LENGTH
from dorothie_gym.tasks import StoryboardTemplate
from dorothie_gym.time_limit import TimeLimitedEnv, decisions_in

_SILENCE, _INTACT = ParticipantAction(), AdWizardAction()


class DrivingSession(Lookups):
    """Session in progress in which the agent only drives: instructor, Ad-Wizard, rewards and end of the episode.

    Attributes:
        session: the session.
        exits: exits of the town's junctions.
        instructor: built-in participant.
        heard: last instruction, as the Co-Wizard remembers it.
        seen: present observations of the roles, each built when it is read.
        driver: what the driver knows at the present decision, its observation and its mask.
        episode: rewards and end of the episode.
    """

    LOOKED_UP: ClassVar[Sequence[str]] = ("_state", "_inputs")

    def __init__(self, session: LiveSession, config: NavigationConfig, exits: JunctionExits) -> None:
        self.session, self.exits, self._config = session, exits, config
        town = session.world.town
        self.instructor = Instructor(town, Guidance(config.guidance))
        streets = [name.value for name in session.scenario.street_names]
        self.driver = driver_arrays(sum(FIELDS.values()), len(ACTIONS), streets)
        self._town_arrays, self._exit_arrays = town_arrays(session.world.network), exit_arrays(town)
        self._cost_to_named = CostToGo(town)
        self._decoder = ActionDecoder(Role.AD_WIZARD, session.limits)
        self._adversary = ScriptedAdWizard(session.limits, rate=config.exceptions) if config.exceptions > 0.0 else None
        seed = policy_seed(session.scenario.seed, Role.AD_WIZARD)
        self._plans = self._adversary.initial_state(seed, town) if self._adversary is not None else None
        self._story = plain_text(session.scenario.storyboard.story, STORY_LENGTH)
        self.heard, self._notes = HeardInstruction(), list[Mental]()
        self._aim: tuple[Place | None, tuple[Place, ...]] = (None, ())  # goal and roadblocks of the last decision
        self.seen: Mapping[str, Observation] = LazyObservations(session)
        marks = read_landmarks(self.seen[Role.CO_WIZARD], town)  # those on its map, for the whole session
        self._known = frozenset(mark.place for mark in marks)
        self.episode, self._task_version = episode_arrays(config), -1
        self._listen()
        self._note_task()
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
        if self.reason is not None:
            from gymnasium.error import ResetNeeded

            raise ResetNeeded("the session is over: call reset() first")
        if self._notes:
            action = replace(action, mental=self._notes.pop(0))
        before, speed = self.session.world.time, float(self.session.world.car.speed)
        self.session.step({Role.PARTICIPANT: _SILENCE, Role.CO_WIZARD: action, Role.AD_WIZARD: self.interfere()})
        self.seen = LazyObservations(self.session)
        self.heard = self.heard.after(self.session.world.time - before, speed, float(self.session.world.car.speed))
        state, left = self._state, self._cost_to_go()  # to the goal of the last decision
        last = float(state["left"])
        state["progress"] = last - left if math.isfinite(left) and math.isfinite(last) else 0.0
        self._listen()
        state["left"] = self._cost_to_go()
        state["acted"] = action.physical is not None
        state["refusals"] = len(self.session.refused[Role.CO_WIZARD])
        self._note_task()
        judge(self.session.world.actors.arrays, self.episode)
        if self.reason is not None:
            self.session.end(self.reason)

    def observe_roles(self) -> None:
        """Builds the observations that are read before the next decision, before the planned path changes."""
        for role in (Role.CO_WIZARD,) if self._is_idle else (Role.CO_WIZARD, Role.AD_WIZARD):
            self.seen[role]

    def observe(self) -> Vector:
        """Looks, and returns the observation of the driver; its view and mask are in `driver`."""
        world, driver = self.session.world, self.driver
        self._inputs["weather"] = tuple(world.weather.values.values())
        self.heard.write(self.exits.town, driver)
        self._cost_to_named.aim(self.heard.goal, self.instructor.blocked if self.heard.goal is not None else ())
        observe(
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
        if self.reason is not None:
            info["is_success"], info["reason"] = self.session.success, self.reason
            info["subgoals"] = {"live": len(self.session.task.live), "reached": int(self._state["reached"])}
        return info

    # --- other roles -------------------------------------------------------------------------------------------------

    def interfere(self) -> RoleAction:
        """Returns the present action of the Ad-Wizard."""
        if self._adversary is None or self._plans is None:
            return _INTACT
        if self._is_idle:
            self._plans = self._plans.advanced()
            return _INTACT
        action, self._plans = self._adversary.step(self.seen[Role.AD_WIZARD], self._plans)
        return self._decoder(action)

    @property
    def _is_idle(self) -> bool:
        """Whether the Ad-Wizard does nothing at this decision."""
        if self._adversary is None or self._plans is None:
            return True
        return self.session.world.time < idle_until(self._adversary, self._plans, self._story)

    def _listen(self) -> None:
        """Lets the instructor speak, and updates the goal."""
        planner = self.session.world.planner
        waits = planner.held and float(self.session.world.car.speed) <= EGO_STANDING
        turning = max(planner.manoeuvre_end - planner.s, 0.1) if planner.in_manoeuvre else 0.0
        goal = self.instructor.goal
        said = self.instructor.instruct(self.seen[Role.PARTICIPANT], self._known, waits=waits, turning=turning)
        if self.instructor.goal is not goal:
            self.heard = replace(self.heard, goal=None)
            self._notes = [Mental(action=MentalAction.GOAL_UPDATE)]
        if said is None:
            return
        self.heard = replace(self.heard, instruction=said, driven=0.0)
        name = said.landmark
        if name is not None:
            self._note_goal(name, said.distance, by_name=said.action is None)

    def _note_goal(self, name: LandmarkName, distance: float, *, by_name: bool) -> None:
        """Queues the belief updates for a goal: a place on the map, or one as far ahead as was said."""
        goal = self.instructor.goal
        assert goal is not None
        self._notes = [Mental(action=MentalAction.GOAL_UPDATE, goals=(name,))]
        if by_name:
            self.heard = replace(self.heard, goal=goal.place)
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
        """Notes the state of the task, and whether the goal or the known roadblocks have changed."""
        task, way, state = self.session.task, self.instructor.cost_to_go, self._state
        if task.version != self._task_version:
            self._task_version = task.version
            state["reached"] = sum(task.reached(i) for i in task.live)
            state["done"], state["succeeded"] = task.done, task.success
        aim = way.goal, way.blocked
        if aim != self._aim:
            self._aim, state["renewed"] = aim, True

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

    @property
    def reward(self) -> float:
        """Reward of the last decision."""
        return float(self._state["reward"])

    @property
    def terms(self) -> dict[str, float]:
        """Terms of the reward, by name."""
        return dict(zip(TERMS, self._state["terms"].tolist(), strict=True))

    @property
    def reason(self) -> str | None:
        """Reason for the end of the episode; None while it goes on."""
        ending = int(self._state["ending"])
        return Ending(ending).label if ending else None

    @property
    def truncated(self) -> bool:
        """Whether time is up."""
        return bool(self._state["ending"] == Ending.OUT_OF_TIME)

    @property
    def terminated(self) -> bool:
        """Whether the destination was reached, the ego has left the road, or the participant gave up."""
        return not self.truncated and bool(self._state["ending"])


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
        drive = self.drive
        instruction = drive.heard.instruction
        if instruction is not None and instruction is not self._shown:
            self._view.note_instruction(instruction.time, words_of(instruction), str(instruction.act))
        self._shown = instruction
        if self.render_mode is not None:
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
