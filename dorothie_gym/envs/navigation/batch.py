"""Batch of navigation sessions in one town: compiled decisions, with Python for rare events."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.ad_wizard_trigger import AdWizardTrigger, permits_changes
from dorothie_gym.envs.navigation.batch_arrays import DrivingFace, DrivingRows, RowHolder
from dorothie_gym.envs.navigation.cameras import DriverObservation, DrivingCameras
from dorothie_gym.envs.navigation.compiled_decision import act_share, guide_share
from dorothie_gym.envs.navigation.decision_state import EVENTS, Event, Stage, row_of
from dorothie_gym.envs.navigation.start import write_scenario
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.session.beliefs import goals_on_map
from dorothie_gym.session.observations import LazyObservations
from dorothie_gym.session.scenario import Scenario, draw_scenario, world_seed_of
from dorothie_gym.session.spaces.actions import LanePosition, Mental
from dorothie_gym.sim.batch.threads import ThreadPool
from dorothie_gym.sim.ego.ego_controller import set_goals
from dorothie_gym.sim.state.world_arrays import lengthened
from dorothie_gym.sim.world_start import WorldSeeds, start_world
from dorothie_gym.support.compilation import direct
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.tasks.storyboard import TaskState

_WAITS, _NEAR, _LOST, _TOLD = map(int, Event)
_act_share, _guide_share = direct(act_share), direct(guide_share)


class DrivingBatch(DrivingRows):
    """Sessions of one town in which only driving is left to the agents.

    Compiled code plays the rows. Python handles rare events: belief updates, exceptions of the Ad-Wizard,
    arrivals, new sessions.
    """

    CACHED_VIEWS: ClassVar[tuple[str, ...]] = (*DrivingRows.CACHED_VIEWS, "_pool", "_cameras")

    @cached_property
    def _pool(self) -> ThreadPool:
        return ThreadPool(self.threads - 1)

    @cached_property
    def _cameras(self) -> DrivingCameras | None:
        """Cameras of the environments; None where the observations are vectors."""
        camera = self._config.camera
        return None if camera is None else DrivingCameras(camera, self._count)

    @property
    def observations(self) -> DriverObservation:
        """Observations at the current decision: vectors (environments, n) or pictures (environments, h, w, 3).

        Callers must copy them. Those of a restored batch are up to date after its next decision.
        """
        return self.vectors if self._cameras is None else self._cameras.pictures

    @property
    def nbytes(self) -> int:
        """Memory of the arrays of all environments, and of their cameras [bytes]."""
        return super().nbytes + (0 if self._cameras is None else self._cameras.nbytes)

    def _draw(self, numbers: Sequence[int]) -> None:
        """Draws the pictures of the given environments, if they observe any."""
        if self._cameras is not None:
            self._cameras.draw(self, numbers, self._pool)

    def close(self) -> None:
        """Ends the threads."""
        self._pool.close()

    # --- Episodes -----------------------------------------------------------------------------------------------------

    def begin(self, seeds: Mapping[int, int], scenario: Scenario | None = None) -> None:
        """Begins sessions.

        Args:
            seeds: seed of the session by environment.
            scenario: scenario to play instead of drawn ones.
        """
        for number, seed in seeds.items():
            self._put(number, draw_scenario(self.town, self._template, seed) if scenario is None else scenario)
        self._guide()
        self._draw(list(seeds))

    def _put(self, number: int, scenario: Scenario) -> None:
        """Starts a session in a row."""
        face = self.faces[number] = DrivingFace(scenario)
        self._blanks.write(number)
        seeds = WorldSeeds(*world_seed_of(scenario).spawn(5))
        start_world(self._network, RowHolder(self, number), self._session_config.world, seeds, scenario.departure)
        marks = scenario.storyboard.landmarks[: self._limits.landmarks]
        write_scenario(
            scenario,
            [self._row_of_costs((mark.lane, mark.station), ()) for mark in marks],
            number,
            self._drivers,
            self._guidances,
            self._drives,
        )
        self._noted.discard(number)
        self._faulty.discard(number)
        if self._config.exceptions > 0.0:
            face.ad_wizard_trigger = AdWizardTrigger(self.town, self._limits, scenario, self._config.exceptions)
            face.ad_wizard_trigger.write(self._plans[number])
        self._note_task(number, TaskState(scenario.storyboard))

    # --- A decision ---------------------------------------------------------------------------------------------------

    def play(self, actions: NDArray[np.generic] | int, playing: NDArray[np.bool_]) -> None:
        """Steps the given environments by one decision.

        Args:
            actions: `NavigationAction` of each environment (n,), or throttle, steering and brake of each (n, 3).
            playing: environments that play (n,).
        """
        state = self._decisions
        state["controls" if self.pedals else "action"] = actions
        state["refused"], state["refusal"] = 0, 0
        state["stage"] = playing * np.int32(Stage.ACTING)
        self._interfere(playing)
        for number in [number for number in self._noted if playing[number]]:
            self._send_note(number)
        events = self._act()
        for number in list(self._faulty):
            self._look(number)
        if events & _NEAR:
            for number in np.flatnonzero(state["near"] & playing).tolist():
                self._arrive(number)
        self._guide()
        self._draw(np.flatnonzero(playing).tolist())

    def _act(self) -> int:
        """Plays the first half of a decision, or lays new paths; returns the `Event` flags."""
        state = self._decisions
        events = all_events = self._share_act()
        while events & _WAITS:
            for number in np.flatnonzero(np.isin(state["stage"], (Stage.MOVING, Stage.NO_SPACE))).tolist():
                if state["stage"][number] == Stage.NO_SPACE:
                    self.make_room(lengthened(self.row(number)))
                else:
                    self._look(number)
            events = self._share_act()
            all_events |= events
        return all_events

    def _guide(self) -> None:
        """Plays the second half of a decision."""
        events = self._share_guide()
        state = self._decisions
        if events & _WAITS:
            self._add_costs()
            events |= self._share_guide()
        if events & _LOST:
            self._foresee()
            self._act()
            self._share_guide()
        if events & _TOLD:
            for number in np.flatnonzero(state["told"]).tolist():
                self._note_goal(number)
                state["told"][number] = False

    def _add_costs(self) -> None:
        """Adds the costs to goals that roadblocks have changed; those that are no longer needed are dropped."""
        state = self._decisions
        used = set(state["costs"].tolist())
        self._cost_rows = {goal: row for goal, row in self._cost_rows.items() if not goal[1] or row in used}
        for number in np.flatnonzero(state["stage"] == Stage.NO_COSTS).tolist():
            guidance = row_of(self._guidances, number)
            mark = plain(guidance.marks)[int(plain(guidance.route)["landmark"][0])]
            goal = int(mark["lane"]), float(mark["station"])
            state["new_costs"][number] = self._row_of_costs(goal, self.blocked(number))

    def _share_act(self) -> int:
        return self.share(_act_share, self._exits, self.worlds, self._drivers, self._drives, self.frames, self.pedals)

    def _share_guide(self) -> int:
        return self.share(
            _guide_share, self._exits, self._tables, self._graph, self._searches, self._common, self.worlds,
            self._drivers, self._guidances, self._episodes, self._drives,
        )  # fmt: skip

    def share(self, work: Callable[..., None], *arguments: object) -> int:
        """Calls `work(turns, home, town, *arguments)` in every thread, and waits for all; returns the `Event` flags."""
        turns = self._turns.copy()
        self._pool.do(work, lambda home: (turns, home, self._arrays, *arguments))
        return int(turns[0, EVENTS]) if len(turns) == 1 else int(np.bitwise_or.reduce(turns[:, EVENTS]))

    # --- Rare events --------------------------------------------------------------------------------------------------

    def _look(self, number: int) -> None:
        """Updates the ego's view after a change of weather or faults."""
        world = self.catch_up(number).world
        world.write_weather()
        self._decisions["faulty"][number] = bool(world.faults)
        if world.faults:
            self._faulty.add(number)
        else:
            self._faulty.discard(number)

    def _interfere(self, playing: NDArray[np.bool_]) -> None:
        """Executes the Ad-Wizards that can now play a planned trick."""
        if self._config.exceptions <= 0.0:
            return
        for number in np.flatnonzero(playing & self._plans["acts"]).tolist():
            face, live, plans = self.face(number), self.catch_up(number), self._plans[number]
            trigger = face.ad_wizard_trigger
            if trigger is None:
                continue
            live.begin_decision()
            seen, face.seen = face.seen or LazyObservations(live), None
            live.play_ad_wizard(trigger.act(seen, int(plans["count"])))
            self._move_in(number)
            trigger.write(plans)
            self._look(number)
            weather = tuple(live.world.weather.values.values())
            plain(self._drivers.inputs)["weather"][number, 0] = weather
            self._note_task(number, live.task)

    def _foresee(self) -> None:
        """Shows the paths that are about to be replaced to the Ad-Wizards that act next."""
        for number in np.flatnonzero(self._plans["acts"] & (self._decisions["stage"] == Stage.LOST)).tolist():
            self.face(number).seen = seen = LazyObservations(self.catch_up(number))
            seen[Role.AD_WIZARD]  # builds them

    def _send_note(self, number: int) -> None:
        """Sends a belief update of the Co-Wizard, which changes where the car slows down."""
        face = self.face(number)
        note, reason = face.notes.pop(0), None
        if face.live is None and note.action is MentalAction.GOAL_UPDATE:
            face.goals = note.goals
            set_goals(RowHolder(self, number), goals_on_map(face.scenario, note.goals))
        else:
            live = self.catch_up(number)
            live.begin_decision()
            reason = live.update_beliefs(note)
            self._move_in(number)
        face.refused = reason or ""
        self._decisions["refused"][number] = reason is not None
        if not face.notes:
            self._noted.discard(number)

    def _arrive(self, number: int) -> None:
        """Completes the subgoals whose waypoint the standing ego has reached."""
        live = self.catch_up(number)
        live.begin_decision()
        live.note_arrivals()
        self._note_task(number, live.task)

    def _note_task(self, number: int, task: TaskState) -> None:
        """Writes the state of the task into the row after a change."""
        face = self.face(number)
        if task.version == face.version:
            return
        face.version = task.version
        self._plans[number]["changes"] = face.ad_wizard_trigger is not None and permits_changes(task)
        subgoals = plain(self._guidances.subgoals)[number]
        for index in range(min(len(task.storyboard.subgoals), len(subgoals))):
            is_open = index in task.live and not task.reached(index)
            subgoals[index] = task.landmark_of(index), is_open, task.allowed(index)
        outcome = self.outcomes[number : number + 1]
        outcome["reached"] = sum(task.reached(index) for index in task.live)
        outcome["done"], outcome["succeeded"] = task.done, task.success
        self._live[number] = len(task.live)

    def _note_goal(self, number: int) -> None:
        """Queues the belief updates for a goal: a place on the map, or a place at the stated distance ahead."""
        face, state = self.face(number), self._decisions[number]
        said = plain(self._guidances.said)[number, 0]
        if state["fresh"]:
            face.notes = [Mental(action=MentalAction.GOAL_UPDATE)]
        if state["said"] and said["landmark"] >= 0:
            name = LandmarkName(int(said["landmark"]))
            face.notes = [Mental(action=MentalAction.GOAL_UPDATE, goals=(name,))]
            if state["told_lane"] >= 0:
                place = LanePosition(lane=int(state["told_lane"]), metres=int(state["told_station"]))
                face.notes.append(Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=name, place=place))
        self._noted.add(number)
