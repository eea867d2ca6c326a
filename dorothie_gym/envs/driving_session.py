"""Session in which only driving is left to the agent, and the base class of the navigation environments."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation.records import plain
from dorothie_gym.copying import Restorable
from dorothie_gym.engine.observations import LazyObservations
from dorothie_gym.engine.path_measurements import UpcomingJunction
from dorothie_gym.engine.scenario import (
    ResetOptions,
    Scenario,
    check_options,
    draw_scenario,
    scenario_option,
    template_option,
)
from dorothie_gym.engine.session_engine import LiveSession
from dorothie_gym.envs.navigation_config import NavigationConfig
from dorothie_gym.envs.session_view import SessionView, metadata_at
from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import LandmarkName, MentalAction, Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.navigation.actions import ACTIONS, FIRST_TURN, UNDER_WAY, NavigationAction, prepares
from dorothie_gym.policies.navigation.driver_view import DriverArrays, driver_arrays, look
from dorothie_gym.policies.navigation.instructor import Guidance, Instructor, NavigationInstruction, words_of
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, exit_arrays
from dorothie_gym.policies.navigation.observation_vector import FIELDS, HeardInstruction, RouteCosts, Vector, encode
from dorothie_gym.policies.observation_parser import read_landmarks
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.sim.ego.feasibility import may_change_cruise
from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.infractions import INFRACTION_KINDS, WorldEventKind
from dorothie_gym.sim.network.network import TownNetwork, network_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.world import World
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
)
from dorothie_gym.tasks import StoryboardTemplate
from dorothie_gym.time_limit import TimeLimitedEnv, decisions_in

NEARER = 1.0
"""Decrease of the cost to go that counts as progress for `patience` [m]."""

LEFT_ROAD_DISTANCE = 15.0
"""Distance from the path beyond which the ego counts as having left the road [m]."""

_RULES = tuple(kind.value for kind in INFRACTION_KINDS if kind is not WorldEventKind.COLLISION)
_SILENCE, _INTACT = ParticipantAction(), AdWizardAction()


class DrivingSession:
    """Session in progress in which the agent only drives: instructor, Ad-Wizard, rewards and end of the episode.

    Attributes:
        session: the session.
        exits: exits of the town's junctions.
        instructor: built-in participant.
        heard: last instruction, as the Co-Wizard remembers it.
        seen: present observations of the roles, each built when it is read.
        driver: what the driver knows at the present decision, and its observation.
        junction: next junction with a choice on the planned path.
        reward: reward of the last decision.
        terms: its terms.
        terminated: whether the destination was reached, or the participant gave up.
        truncated: whether time is up.
    """

    def __init__(self, session: LiveSession, config: NavigationConfig, exits: JunctionExits) -> None:
        self.session, self.exits, self._config = session, exits, config
        town = session.world.town
        self.instructor = Instructor(town, exits, Guidance(config.guidance))
        streets = [name.value for name in session.scenario.street_names]
        self.driver = driver_arrays(sum(FIELDS.values()), streets)
        self.junction = UpcomingJunction(session.world)
        self._town_arrays, self._exit_arrays = town_arrays(session.world.network), exit_arrays(town)
        self._costs = RouteCosts(town)
        self._decoder = ActionDecoder(Role.AD_WIZARD, session.limits)
        self._adversary = ScriptedAdWizard(session.limits, rate=config.exceptions) if config.exceptions > 0.0 else None
        seed = policy_seed(session.scenario.seed, Role.AD_WIZARD)
        self._plans = self._adversary.initial_state(seed, town) if self._adversary is not None else None
        self.heard, self._notes = HeardInstruction(), list[Mental]()
        self._aim: tuple[Place | None, tuple[Place, ...]] = (None, ())  # goal and roadblocks that `_nearest` refers to
        self.seen: Mapping[str, Observation] = LazyObservations(session)
        marks = read_landmarks(self.seen[Role.CO_WIZARD], town)  # those on its map, for the whole session
        self._known = frozenset(mark.place for mark in marks)
        self._rules_broken, self._collisions = self._count_infractions(), 0
        self._nearest, self._nearest_at = math.inf, 0.0
        self.reward, self.terms = 0.0, dict.fromkeys(vars(config.weights), 0.0)
        self.terminated = self.truncated = False
        self.reason: str | None = None
        self._listen()
        self._left = self._cost_to_go()
        self._look()

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
        if self.terminated or self.truncated:
            from gymnasium.error import ResetNeeded

            raise ResetNeeded("the session is over: call reset() first")
        if self._notes:
            action = replace(action, mental=self._notes.pop(0))
        reached, before, speed = self._count_reached(), self.session.world.time, float(self.session.world.car.speed)
        self.session.step({Role.PARTICIPANT: _SILENCE, Role.CO_WIZARD: action, Role.AD_WIZARD: self.interfere()})
        self.seen = LazyObservations(self.session)
        self.heard = self.heard.after(self.session.world.time - before, speed, float(self.session.world.car.speed))
        progress = self._progress()
        self._listen()
        self._left = self._cost_to_go()
        self._note_patience()
        self._end()
        self._reward(progress, self._count_reached() - reached, action.physical is not None)
        self._look()

    def observe_roles(self) -> None:
        """Builds the observations that are read before the next decision, before the planned path changes."""
        for role in (Role.CO_WIZARD, Role.AD_WIZARD) if self._adversary is not None else (Role.CO_WIZARD,):
            self.seen[role]

    def _look(self) -> None:
        """Fills the driver's view."""
        world, inputs = self.session.world, plain(self.driver.inputs)[0]
        path, options = world.planner.path, self.junction.options()
        manoeuvre, angle = world.planner.manoeuvre
        inputs["cruise"], inputs["lights"], inputs["motion"] = world.ego.cruise, world.ego.lights, self.session.motion
        inputs["manoeuvre"], inputs["angle"] = manoeuvre or 0, angle
        inputs["weather"] = tuple(world.weather.values.values())
        look(
            self._town_arrays, self._exit_arrays, world.sensing_arrays, self.driver,
            path.s, path.points, world.planner.s, options.lane, options.distance,
        )  # fmt: skip

    def observe(self) -> Vector:
        """Returns the observation of the driver."""
        self.heard.write(self.exits.town, self.driver)
        self._costs.write(self.heard.goal, self.instructor.blocked, self.driver)
        encode(self.driver, self._config.max_seconds)
        return self.driver.vector.copy()

    def info(self) -> StepInfo:
        """Returns the info of the last decision, as a new dictionary."""
        info: StepInfo = {
            "reward_terms": dict(self.terms),
            "refused": list(self.session.refused[Role.CO_WIZARD]),
            "infractions": dict(self.session.infractions),
        }
        if self.terminated or self.truncated:
            info["is_success"], info["reason"] = self.session.success, self.reason
            info["subgoals"] = {"live": len(self.session.task.live), "reached": self._count_reached()}
        return info

    # --- other roles -------------------------------------------------------------------------------------------------

    def interfere(self) -> RoleAction:
        """Returns the present action of the Ad-Wizard."""
        if self._adversary is None or self._plans is None:
            return _INTACT
        action, self._plans = self._adversary.step(self.seen[Role.AD_WIZARD], self._plans)
        return self._decoder(action)

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

    def _progress(self) -> float:
        """Returns the decrease of the cost to go [m]; to be called before the goal changes."""
        left = self._cost_to_go()
        return self._left - left if math.isfinite(left) and math.isfinite(self._left) else 0.0

    def _note_patience(self) -> None:
        now = self.session.world.time
        way = self.instructor.cost_to_go
        aim = way.goal, way.blocked
        if aim != self._aim or self._left < self._nearest - NEARER:
            self._aim, self._nearest, self._nearest_at = aim, self._left, now

    def _end(self) -> None:
        session, now = self.session, self.session.world.time
        arrived = session.task.done
        left_road = abs(session.world.planner.offset) > LEFT_ROAD_DISTANCE
        gave_up = now - self._nearest_at >= self._config.patience - 1e-9
        self.terminated = arrived or left_road or gave_up
        self.truncated = not self.terminated and now >= self._config.max_seconds - 1e-9
        if self.terminated or self.truncated:
            reasons = {"arrived": arrived, "left the road": left_road, "gave up": gave_up, "out of time": True}
            self.reason = next(reason for reason, holds in reasons.items() if holds)
            session.end(self.reason)

    def _reward(self, progress: float, reached: int, physical: bool) -> None:
        weights, session = self._config.weights, self.session
        rules, collisions = self._count_infractions(), session.world.collisions
        self.terms = {
            "progress": weights.progress * progress,
            "subgoal": weights.subgoal * reached,
            "success": weights.success * session.success,
            "collision": weights.collision * (collisions - self._collisions),
            "infraction": weights.infraction * (rules - self._rules_broken),
            "gave_up": weights.gave_up * (self.terminated and self.reason != "arrived"),
            "time": weights.time / self._config.decision_frequency,
            "action": weights.action * (physical and not session.refused[Role.CO_WIZARD]),
            "refusal": weights.refusal * len(session.refused[Role.CO_WIZARD]),
        }
        self._rules_broken, self._collisions = rules, collisions
        self.reward = float(sum(self.terms.values()))

    def _count_reached(self) -> int:
        return sum(self.session.task.reached(i) for i in self.session.task.live)

    def _count_infractions(self) -> int:
        infractions = self.session.infractions
        return sum(infractions[name] for name in _RULES)


Action = TypeVar("Action")


class DrivingEnv(Restorable, TimeLimitedEnv[Vector, Action]):
    """Base class of the navigation environments; subclasses define observations and actions."""

    CHANGES: ClassVar[Sequence[str]] = ("_drive", "_controls", "_shown", "_np_random", "_np_random_seed")

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
        self._controls: NavigationMask | None = None

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


class NavigationMask:
    """Mask of the actions that the car of a session would carry out, computed from its planned path.

    Attributes:
        exits: exits of the town's junctions.
    """

    def __init__(self, world: World, exits: JunctionExits, junction: UpcomingJunction) -> None:
        self._world, self.exits, self._junction = world, exits, junction

    @property
    def choice(self) -> tuple[int, float] | None:
        """Lane before the next junction with a choice, and the distance to it [m]; None if the path comes to none."""
        options = self._junction.options()
        return (options.lane, options.distance) if options.exits else None

    def mask(self, driver: DriverArrays) -> NDArray[np.int8]:
        """Returns the mask (18,), 1 for feasible actions; `driver` has the view of the present decision."""
        world, planner = self._world, self._world.planner
        speed, cruise = float(world.car.speed), world.ego.cruise
        mask = np.zeros(len(ACTIONS), dtype=np.int8)
        mask[NavigationAction.NOTHING] = mask[NavigationAction.LIGHTS] = 1
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not planner.held, planner.held
        mask[NavigationAction.FASTER] = may_change_cruise(cruise, True)
        mask[NavigationAction.SLOWER] = may_change_cruise(cruise, False)
        feasible = planner.feasible(speed)
        mask[NavigationAction.SWITCH_LEFT] = feasible.switch_left
        mask[NavigationAction.SWITCH_RIGHT] = feasible.switch_right
        mask[NavigationAction.U_TURN] = feasible.u_turn
        mask[NavigationAction.LANE_FOLLOW] = feasible.lane_follow
        for action in UNDER_WAY:
            mask[action] |= prepares(driver, action)
        choice = self.choice if feasible.j_turn else None
        if choice is not None:
            mask[FIRST_TURN:] = [way is not None for way in self.exits.by_sector(choice[0])]
        return mask
