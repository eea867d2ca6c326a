"""Arrays of a batch of navigation sessions in one town, a row for each: worlds, drivers, instructors and results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Final, cast

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.ad_wizard_trigger import AdWizardTrigger
from dorothie_gym.envs.navigation.decision_state import CRUISE_LIMIT, DriveArrays, DrivingTown, row_of
from dorothie_gym.envs.navigation.episode import EpisodeArrays
from dorothie_gym.envs.navigation.start import Blanks, blank_parts, blank_world, copy_row, stacked, with_room
from dorothie_gym.maps.route_arrays import empty_search
from dorothie_gym.maps.routing_graph import routing_graph
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies.navigation.cost_to_go import cost_table
from dorothie_gym.policies.navigation.driver_view import DriverArrays
from dorothie_gym.policies.navigation.instructor import exit_sectors, instruction_of
from dorothie_gym.policies.navigation.instructor_arrays import InstructorArrays
from dorothie_gym.policies.navigation.junction_exits import exit_arrays
from dorothie_gym.policies.navigation.observation_vector import HeardInstruction
from dorothie_gym.policies.route_tables import route_tables
from dorothie_gym.session.live_session import LiveSession
from dorothie_gym.session.observations import LazyObservations
from dorothie_gym.session.scenario import Scenario, fitting_templates
from dorothie_gym.session.spaces.actions import Mental
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.sim.batch.threads import turns_of
from dorothie_gym.sim.ego.ego_controller import CRUISE_REFUSAL, REASONS
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.codes import Refusal
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, with_room_of
from dorothie_gym.sim.traffic_rules import INFRACTION_KINDS
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import CachedViews, taken

if TYPE_CHECKING:
    from dorothie_gym.envs.navigation.config import NavigationConfig
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.navigation.observation_fields import Vector
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

ROOMS: Final = ("vehicles", "pedestrians", "props", "course", "steps", "goals")
"""Arrays of a world whose lengths differ between worlds of a town."""


MUTABLE_ATTRIBUTES: Final = ("faces", "_stacks", "_live", "_noted", "_faulty")
"""Attributes of a batch that hold changing values."""


INFRACTIONS: Final = tuple(kind.value for kind in INFRACTION_KINDS)
"""Names of the infractions that infos count."""


REFUSED: Final = ("mental", "physical")
"""Kinds of actions that may be refused: belief updates, which are made automatically, and driving actions."""


@dataclass
class DrivingFace:
    """Objects of a session of a batch besides its row.

    Attributes:
        scenario: storyboard, street names and departure.
        live: the session with objects for rare events, whose world shows the row; None before the first of them.
        ad_wizard_trigger: scripted Ad-Wizard; None without exceptions.
        goals: goals of the Co-Wizard as long as there is no `live`.
        notes: belief updates that wait to be sent.
        version: version of the task that the row knows.
        refused: reason for the refusal of the belief update at the last decision that had one; "" if it had an effect.
        seen: observations for the Ad-Wizard's next action, if they were built before the path was replaced.
    """

    scenario: Scenario
    live: LiveSession | None = None
    ad_wizard_trigger: AdWizardTrigger | None = None
    goals: tuple[LandmarkName, ...] = ()
    notes: list[Mental] = field(default_factory=list)
    version: int = -1
    refused: str = ""
    seen: LazyObservations | None = None


class RowHolder:
    """Holder of the world in a row of a batch; arrays with more room make room in all rows."""

    def __init__(self, batch: DrivingRows, number: int) -> None:
        self._batch, self._number = batch, number

    @property
    def arrays(self) -> WorldArrays:
        """Arrays of the world."""
        return self._batch.row(self._number)

    @arrays.setter
    def arrays(self, arrays: WorldArrays) -> None:
        self._batch.make_room(arrays)


class DrivingRows(CachedViews):
    """Sessions of one town, each in a row of arrays, with the results of their last decision.

    Attributes:
        town: the map.
        faces: current session of each environment; None before its first.
        frames: substeps of a decision.
        pedals: whether the agents use throttle, steering and brake.
        threads: number of threads, the caller's included.
    """

    CACHED_VIEWS: ClassVar[tuple[str, ...]] = ("_rows", "_blanks", "_decisions", "_plans", "outcomes", "infractions")

    def __init__(
        self,
        town: Town,
        template: StoryboardTemplate | None,
        config: NavigationConfig,
        count: int,
        threads: int,
        *,
        pedals: bool = False,
    ) -> None:
        """Prepares for sessions.

        Args:
            town: the map.
            template: template of the storyboards; None draws one for each session.
            config: settings.
            count: number of environments.
            threads: number of threads at most.
            pedals: whether the agents use throttle, steering and brake; else they choose a `NavigationAction`.
        """
        self.town, self._template, self._config, self._count = town, template, config, count
        self.threads = max(1, min(threads, count))
        self._limits, self._network = SpaceLimits.for_town(town), network_of(town)
        self._arrays, self._exits = town_arrays(self._network), exit_arrays(town)
        self._tables, self._graph = route_tables(town), routing_graph(town)
        self._searches = stacked(empty_search(self._graph), self.threads)
        self._cost_rows: dict[tuple[Place, tuple[Place, ...]], int] = {}
        if not town.sites:
            fitting_templates(town)  # raises the error
        first = town.sites[0]
        self._common = DrivingTown(
            exit_sectors(town),
            np.zeros((1, len(cost_table(town, (first.lane, first.station)).costs))),
            float(config.max_seconds),
            pedals,
        )
        self._session_config = config.session_config
        self.frames, self.pedals = self._session_config.frames, pedals
        self.faces: list[DrivingFace | None] = [None] * count
        self._stacks: list[Any] = []
        self._live = np.zeros(count, dtype=np.int64)
        self._turns = turns_of(count, self.threads)
        self._noted, self._faulty = set[int](), set[int]()

    @cached_property
    def _rows(self) -> dict[int, WorldArrays]:
        """Rows of the worlds that `row` has returned."""
        return {}

    @cached_property
    def _blanks(self) -> Blanks:
        world = blank_world(self._network, self._config, pedals=self.pedals)
        parts = blank_parts(self.town, self._limits, self._config, pedals=self.pedals)
        if not self._stacks:
            self._stacks = [stacked(arrays, self._count) for arrays in (world, *parts)]
        return Blanks(self._stacks, (with_room_of(self._arrays, world, self.row(0)), *parts))

    def __setstate__(self, values: dict[str, object]) -> None:
        self.__dict__.update(values)
        self._show_rows(self._sessions())

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values of the sessions."""
        values = self.__getstate__()
        used = {*self._decisions["costs"].tolist(), *self._drives.rows.ravel().tolist()} if self._stacks else set()
        goals = {row: goal for goal, row in self._cost_rows.items() if row in used}
        return {"goals": goals, **{name: values[name] for name in MUTABLE_ATTRIBUTES}}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of `mutable_values`; the costs to the goals may be in other rows here."""
        goals = taken(values, "goals", dict)
        self.__setstate__(values)
        if not self._stacks:
            return
        rows = np.zeros(1 + max(goals, default=0), dtype=np.int32)
        for row, goal in goals.items():
            rows[row] = self._row_of_costs(*goal)
        self._drives.rows[...] = rows[self._drives.rows]
        self._decisions["costs"] = rows[self._decisions["costs"]]

    def _sessions(self) -> Iterator[tuple[int, LiveSession]]:
        """Yields the sessions that have objects, by the number of their environment."""
        for number, face in enumerate(self.faces):
            if face is not None and face.live is not None:
                yield number, face.live

    def _show_rows(self, sessions: Iterable[tuple[int, LiveSession]]) -> None:
        """Lets sessions show their rows, after the arrays were replaced."""
        self._forget_views()
        for number, live in sessions:
            live.world.actors.arrays = self.row(number)

    def _forget_views(self) -> None:
        for name in DrivingRows.CACHED_VIEWS:
            self.__dict__.pop(name, None)

    # --- Arrays of all environments -----------------------------------------------------------------------------------

    @property
    def worlds(self) -> WorldArrays:
        """Arrays of the worlds of all environments."""
        return cast(WorldArrays, self._stacks[0])

    @property
    def _drivers(self) -> DriverArrays:
        return cast(DriverArrays, self._stacks[1])

    @property
    def _guidances(self) -> InstructorArrays:
        return cast(InstructorArrays, self._stacks[2])

    @property
    def _episodes(self) -> EpisodeArrays:
        return cast(EpisodeArrays, self._stacks[3])

    @property
    def _drives(self) -> DriveArrays:
        return cast(DriveArrays, self._stacks[4])

    @property
    def vectors(self) -> Vector:
        """Vectors at the current decision (environments, n); callers must copy them."""
        return self._drivers.vector

    @property
    def masks(self) -> NDArray[np.int8]:
        """Feasible actions at the current decision (environments, 18); callers must copy them."""
        return self._drivers.mask

    @cached_property
    def outcomes(self) -> NDArray[np.void]:
        """`EpisodeRecord` of each environment (environments,)."""
        return plain(self._episodes.state)[:, 0]

    @cached_property
    def infractions(self) -> NDArray[np.int64]:
        """Numbers of infractions so far (environments, 5), ordered as `INFRACTION_KINDS`; callers must copy them."""
        counts: NDArray[np.int64] = plain(self.worlds.watch)[:, 0]["counts"]
        return counts

    @property
    def successes(self) -> NDArray[np.bool_]:
        """Whether every live subgoal was reached, the destination last, without a collision that the ego caused."""
        outcomes, collisions = self.outcomes, plain(self.worlds.car)[:, 0]["collisions"]
        successes: NDArray[np.bool_] = (collisions == 0) & outcomes["done"] & outcomes["succeeded"]
        return successes

    @property
    def live_subgoals(self) -> NDArray[np.int64]:
        """Numbers of subgoals that count (environments,)."""
        return self._live

    @property
    def nbytes(self) -> int:
        """Memory of the arrays of all environments [bytes]."""
        return sum(array.nbytes for stack in self._stacks for array in stack)

    def refusals(self, number: int) -> dict[str, str]:
        """Returns the reason for the refusal of each of `REFUSED` at the last decision of an environment, or ""."""
        face, state = self.faces[number], self._decisions[number]
        reasons = dict.fromkeys(REFUSED, "")
        if face is not None and state["refused"]:
            reasons["mental"] = face.refused
        if state["refusal"] > 0:
            known = state["refusal"] != CRUISE_LIMIT
            reason = REASONS[Refusal(int(state["refusal"]))] if known else CRUISE_REFUSAL
            reasons["physical"] = f"{PhysicalAction(int(state['order'])).label}: {reason}"
        return reasons

    @property
    def any_refused(self) -> NDArray[np.bool_]:
        """Environments whose last decision had a refusal (environments,)."""
        refused: NDArray[np.bool_] = (self._decisions["refusal"] > 0) | (self._decisions["refused"] > 0)
        return refused

    @cached_property
    def _decisions(self) -> NDArray[np.void]:
        return plain(self._drives.state)[:, 0]

    @cached_property
    def _plans(self) -> NDArray[np.void]:
        return plain(self._drives.plans)[:, 0]

    def driver(self, number: int) -> DriverArrays:
        """Returns the arrays of the driver of an environment: views."""
        return row_of(self._drivers, number)

    def heard(self, number: int) -> HeardInstruction:
        """Returns the last instruction of an environment, as its driver remembers it."""
        guidance, record = row_of(self._guidances, number), plain(self._drivers.heard)[number, 0]
        goal = (int(record["goal_lane"]), float(record["goal_station"])) if record["goal_lane"] >= 0 else None
        given = instruction_of(guidance) if plain(guidance.said)["given"][0] else None
        return HeardInstruction(instruction=given, driven=float(record["driven"]), goal=goal)

    def goal(self, number: int) -> Place | None:
        """Returns the place that progress in an environment is measured to, or None."""
        state = self._decisions[number]
        return (int(state["goal_lane"]), float(state["goal_station"])) if state["goal_lane"] >= 0 else None

    def blocked(self, number: int) -> tuple[Place, ...]:
        """Returns the places beyond the roadblocks that the instructor of an environment has seen."""
        guidance = row_of(self._guidances, number)
        closed = plain(guidance.closed)[: int(plain(guidance.route)["closed"][0])]
        return tuple((lane, station) for station, lane in closed.tolist())

    @property
    def has_begun(self) -> bool:
        """Whether every environment has a session."""
        return None not in self.faces

    # --- Sessions and rows ------------------------------------------------------------------------------------------

    def face(self, number: int) -> DrivingFace:
        """Returns the face of an environment; raises `ResetNeeded` before its first session."""
        face = self.faces[number]
        if face is None:
            raise ResetNeeded(f"environment {number} has no session: call reset() first")
        return face

    def catch_up(self, number: int) -> LiveSession:
        """Returns the session of an environment, with the time and place of its row."""
        face = self.face(number)
        if face.live is None:
            face.live = LiveSession(
                self.town, self._network, face.scenario, self._session_config, self._limits, self.row(number)
            )
            face.live.beliefs.goals = face.goals
        else:
            face.live.world.catch_up()
        return face.live

    def _move_in(self, number: int) -> None:
        """Copies the world of a session into its row, and makes the session show the row."""
        actors = self.catch_up(number).world.actors
        if actors.arrays is self.row(number):
            return
        self.make_room(actors.arrays)
        copy_row(self.row(number), with_room_of(self._arrays, actors.arrays, self.row(number)))
        actors.arrays = self.row(number)

    def row(self, number: int) -> WorldArrays:
        """Returns the arrays of the world of an environment, the same object as long as there is room in them."""
        row = self._rows.get(number)
        if row is None:
            row = self._rows[number] = row_of(self.worlds, number)
        return row

    def make_room(self, world: WorldArrays) -> None:
        """Gives all rows the room of a world, if they have less."""
        first = self.row(0)
        if all(len(getattr(first, name)) >= len(getattr(world, name)) for name in ROOMS):
            return
        shown = [(number, live) for number, live in self._sessions() if live.world.actors.arrays is self.row(number)]
        self._stacks[0] = with_room(self._arrays, self.worlds, with_room_of(self._arrays, first, world))
        self._show_rows(shown)

    def _row_of_costs(self, goal: Place, blocked: tuple[Place, ...]) -> int:
        """Returns the row of the costs to a goal; new ones are added."""
        row = self._cost_rows.get((goal, blocked))
        if row is None:
            taken = set(self._cost_rows.values())
            row = next(free for free in range(len(taken) + 1) if free not in taken)
            self._cost_rows[goal, blocked] = row
            if row == len(self._common.costs):
                more = np.zeros((2 * row, self._common.costs.shape[1]))
                more[:row] = self._common.costs
                self._common = self._common._replace(costs=more)
            self._common.costs[row] = cost_table(self.town, goal, blocked).costs
        return row
