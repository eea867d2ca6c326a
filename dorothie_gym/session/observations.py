"""Observations and action masks of the roles. A value that a role must not know is never written into either."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue.conversation import Utterance
from dorothie_gym.ontology.dialogue_acts import encode_slots
from dorothie_gym.ontology.labelled_enums import complete
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.session.config import EnvConfig, PerceptionModel
from dorothie_gym.session.observed_tables import write_landmarks, write_subgoals
from dorothie_gym.session.providers import VisiblePerception, see_by_camera
from dorothie_gym.session.sensor_readings import SensorReadings
from dorothie_gym.session.spaces.actions import NO_MOVE
from dorothie_gym.session.spaces.fields import MESSAGE_LENGTH, STORY_LENGTH, SpaceLimits, plain_text
from dorothie_gym.session.spaces.observations import (
    MAX_UTTERANCE,
    MESSAGE_KINDS,
    Observation,
)
from dorothie_gym.session.view_arrays import Mask, RoleArrays
from dorothie_gym.session.view_steps import EVERYTHING, SessionViews
from dorothie_gym.sim.ego.motion_control import motion_of
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support.compilation import direct
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.beliefs import BeliefTracker
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.sim.traffic_rules import WorldEvent
    from dorothie_gym.sim.world import World
    from dorothie_gym.tasks.storyboard import TaskState


# --- Action masks -----------------------------------------------------------------------------------------------------
# Action masks of the three roles, in the form that `Dict.sample(mask=...)` takes.

RoleMask: TypeAlias = dict[str, Mask | tuple[Mask, ...] | None]
"""Mask of a role's action space, by field; None for fields without a mask."""


@dataclass(frozen=True, kw_only=True)
class PropCount:
    """Number of props in a session.

    Attributes:
        placed: number of props in the town.
        most: number of props that may be there.
    """

    placed: int
    most: int


FEASIBLE: Final[Mapping[ExceptionKind, Callable[[TaskState, PropCount], bool]]] = complete(
    {
        ExceptionKind.NONE: lambda task, props: True,
        ExceptionKind.WEATHER: lambda task, props: True,
        ExceptionKind.SPAWN_VEHICLES: lambda task, props: True,
        ExceptionKind.SPAWN_PEDESTRIANS: lambda task, props: True,
        ExceptionKind.PLACE_PROP: lambda task, props: props.placed < props.most,
        ExceptionKind.MOVE_PROP: lambda task, props: props.placed > 0,
        ExceptionKind.DELETE_PROP: lambda task, props: props.placed > 0,
        ExceptionKind.SENSOR_FAULT: lambda task, props: True,
        ExceptionKind.TASK_TRIGGER: lambda task, props: bool(task.possible_triggers()),
        ExceptionKind.TASK_DELETE: lambda task, props: bool(task.possible_deletions()),
        ExceptionKind.TASK_CHANGE: lambda task, props: bool(task.possible_changes()),
        ExceptionKind.MESSAGE: lambda task, props: True,
    },
    ExceptionKind,
    "FEASIBLE",
    __name__,
)
"""Whether an exception of a kind is feasible now for some arguments."""


class ActionMasks(CachedViews):
    """Action masks of a session.

    Fields are masked independently, so an action inside the mask may still be refused for a combination of its fields.
    Box, text and multi-binary fields have no mask (None). Compiled code writes the masks of physical actions
    (`view_steps`); those of exceptions are written when the props or the task have changed, the others once.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_exceptions",)

    def __init__(self, views: SessionViews, task: TaskState) -> None:
        """Writes the constant masks of the session.

        Args:
            views: the row of the session.
            task: progress in the storyboard.
        """
        self._views, self._task = views, task
        town = views.world.town
        longest = max(lane.length for lane in town.lanes)
        for role in AGENT_ROLES:
            masks = {name: array[views.row] for name, array in views.arrays.masks[role].arrays.items()}
            for mask in masks.values():
                mask[...] = 1
            if "lane" in masks:
                masks["lane"][len(town.lanes) :] = 0
                masks["metres"][int(longest) + 1 :] = 0
            if "plan" in masks:
                masks["plan"][:, len(town.junctions) + 1 :] = 0
        self._task_state = (-1, -1)

    @cached_property
    def _exceptions(self) -> Mask:
        mask: Mask = self._views.arrays.masks[Role.AD_WIZARD].arrays["exception"][self._views.row]
        return mask

    def mask(self, role: Role) -> RoleMask:
        """Returns the mask of a role's action space at the current decision; the caller owns it."""
        if role is Role.CO_WIZARD:
            self._views.find_feasible()
        elif role is Role.AD_WIZARD:
            self.write()
        arrays = self._views.arrays.masks[role].copy_row(self._views.row)
        fields: RoleMask = {**arrays, **dict.fromkeys(self._views.arrays.unmasked[role])}
        if role is Role.CO_WIZARD:
            fields["plan"] = tuple(arrays["plan"])
        return fields

    def write(self) -> None:
        """Writes the mask of exceptions if props or task have changed."""
        task, actors = self._task, self._views.world.actors
        props = len(actors.props) if actors.has_props else 0
        if (task.version, props) == self._task_state:
            return
        self._task_state = task.version, props
        counted = PropCount(placed=props, most=self._views.most_props)
        for kind, feasible in FEASIBLE.items():
            self._exceptions[kind] = feasible(task, counted)


# --- Observations -----------------------------------------------------------------------------------------------------

Table = NDArray[np.float64]

_SENSORS = tuple(Sensor)
_motion_of = direct(motion_of)
_PROP_NUMBERS = {kind: 1.0 + k for k, kind in enumerate(PropKind)}


@dataclass(kw_only=True)
class DeliveredMessages:
    """Speech and messages that reach the roles at a decision.

    Attributes:
        said: utterances that ended since the last decision, by speaker.
        heard: the same utterances as the listener recognises them.
        message: message of the Ad-Wizard to the participant.
        speaking: remaining speaking time of each role [s].
    """

    said: Mapping[Role, Utterance]
    heard: Mapping[Role, Utterance]
    message: str
    speaking: Mapping[Role, float]


class ObservationBuilder(CachedViews):
    """Builds the observations of a session for the requested roles.

    Compiled code writes values that change at every decision (`view_steps`). Constant values are written once, and
    rarely changing ones when they change.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_tables",)

    def __init__(self, views: SessionViews, scenario: Scenario, task: TaskState, beliefs: BeliefTracker) -> None:
        """Writes the constant observations of the session.

        Args:
            views: the row of the session.
            scenario: storyboard, street names and departure.
            task: progress in the storyboard.
            beliefs: places of hidden landmarks as the Co-Wizard has stated them.
        """
        self._views, self._world, self._task, self._beliefs = views, views.world, task, beliefs
        self._weather: Mapping[WeatherParameter, float] | None = None
        self._faults: tuple[Sensor, ...] = ()
        self._versions = (-1, -1)
        self._props = 0
        self._heard = self._spoke = True  # whether utterances, or remaining speaking times, may be in the row
        views.arrays.clear(views.row)
        self._write_constants(scenario)

    @cached_property
    def _tables(self) -> dict[Role, Observation]:
        """Arrays of the row, by role and field."""
        return self._views.tables()

    def build(self, delivered: DeliveredMessages, roles: Sequence[Role]) -> dict[str, Observation]:
        """Builds the observations of the given roles, by agent, each in its observation space.

        Args:
            delivered: speech and messages of the last decision.
            roles: the roles that observe.
        """
        self._views.observe(roles)
        self.write(delivered)
        arrays, row = self._views.arrays, self._views.row
        return {_NAMES[role]: arrays.observation(role, row) for role in roles}

    def view(self, delivered: DeliveredMessages, roles: Sequence[Role]) -> dict[str, Observation]:
        """Returns the result of `build` as views that are valid until the next decision, see `RowView`."""
        self._views.observe(roles)
        self.write(delivered)
        return {_NAMES[role]: self._views.view(role) for role in roles}

    def write(self, delivered: DeliveredMessages) -> None:
        """Writes all values that the compiled code does not write: utterances, and changes of the rest."""
        self._write_talk(delivered)
        self._write_props()
        weather = self._world.weather.values  # another object after a change
        if weather is not self._weather:
            self._weather = weather
            for role, table in self._tables.items():
                table["weather"][:] = tuple(weather.values())
                self._views.renew(role, "weather")
        faults = tuple(self._world.faults)
        if faults != self._faults:
            self._faults = faults
            self._tables[Role.AD_WIZARD]["sensors"][:] = [sensor in faults for sensor in _SENSORS]
            self._views.renew(Role.AD_WIZARD, "sensors")
        versions = self._task.version, self._beliefs.version
        if versions != self._versions:
            self._versions = versions
            self._write_tasks()
            self._write_guesses(self._tables[Role.CO_WIZARD]["guesses"])

    def motion(self) -> Motion:
        """Returns the state of motion of the ego."""
        return Motion(_motion_of(self._world.actors.arrays))

    # --- rarely changing values -------------------------------------------------------------------------------------

    def _write_constants(self, scenario: Scenario) -> None:
        participant, co_wizard, ad_wizard = (self._tables[role] for role in AGENT_ROLES)
        landmarks = scenario.storyboard.landmarks[: len(ad_wizard["hidden"])]
        known = [landmark for landmark in landmarks if not landmark.hidden]
        write_landmarks(participant["landmarks"], landmarks)
        write_landmarks(ad_wizard["landmarks"], landmarks)
        write_landmarks(co_wizard["landmarks"], known)
        ad_wizard["hidden"][: len(landmarks)] = [landmark.hidden for landmark in landmarks]
        for table in self._tables.values():
            table["street_names"][: len(scenario.street_names)] = [name.value for name in scenario.street_names]
        story = plain_text(scenario.storyboard.story, STORY_LENGTH)
        self._views.set_text(Role.PARTICIPANT, "story", story)
        self._views.set_text(Role.AD_WIZARD, "story", story)
        subgoals = scenario.storyboard.subgoals[: len(ad_wizard["subgoals"])]
        self._write_lines(Role.AD_WIZARD, "changes", (subgoal.change for subgoal in subgoals))
        for kind in MESSAGE_KINDS:
            messages = (getattr(subgoal.messages, kind) for subgoal in subgoals)
            self._write_lines(Role.AD_WIZARD, f"{kind}_messages", (message and str(message) for message in messages))

    def _write_lines(self, role: Role, field: str, lines: Iterable[str | None]) -> None:
        """Writes a text with a line for each subgoal, empty for None."""
        self._views.set_text(role, field, plain_text("\n".join(line or "" for line in lines), STORY_LENGTH))

    def _write_tasks(self) -> None:
        rows = range(min(len(self._task.storyboard.subgoals), len(self._tables[Role.AD_WIZARD]["subgoals"])))
        for role, numbers in ((Role.PARTICIPANT, self._task.live), (Role.AD_WIZARD, rows)):
            self._write_lines(role, "tasks", map(self._task.description, numbers))
        for role, permissions in ((Role.PARTICIPANT, False), (Role.AD_WIZARD, True)):
            write_subgoals(self._tables[role]["subgoals"], self._task, permissions=permissions)
            self._views.renew(role, "subgoals")

    def _write_guesses(self, table: Table) -> None:
        table[:] = 0.0
        for name, guess in self._beliefs.places.items():
            (xx, xy), (_, yy) = guess.covariance
            table[name.value] = (1.0, *guess.mean, xx, yy, xy)
        self._views.renew(Role.CO_WIZARD, "guesses")

    def _write_props(self) -> None:
        """Writes the props, if there are any or have been."""
        if not (self._props or self._world.actors.has_props):
            return
        props, table = self._world.actors.props, self._tables[Role.AD_WIZARD]["props"]
        for row, prop in zip(table, props, strict=False):
            row[:] = _PROP_NUMBERS[prop.kind], prop.position[0], prop.position[1], prop.heading
        self._props = min(len(props), len(table))
        table[self._props :] = 0.0
        self._views.renew(Role.AD_WIZARD, "props")

    # --- talk -------------------------------------------------------------------------------------------------------

    def _write_talk(self, delivered: DeliveredMessages) -> None:
        participant, co_wizard, _ = (self._tables[role] for role in AGENT_ROLES)
        spoke = any(delivered.speaking.values())
        if spoke or self._spoke:
            participant["speaking"][0] = delivered.speaking[Role.PARTICIPANT]
            co_wizard["speaking"][0] = delivered.speaking[Role.CO_WIZARD]
            participant["other_speaking"][0] = delivered.speaking[Role.CO_WIZARD] > 0.0
            co_wizard["other_speaking"][0] = delivered.speaking[Role.PARTICIPANT] > 0.0
        heard = bool(delivered.said or delivered.message)
        if heard or self._heard:
            message = plain_text(delivered.message, MESSAGE_LENGTH) if delivered.message else ""
            self._views.set_text(Role.PARTICIPANT, "message", message)
            for listener, speaker in ((Role.PARTICIPANT, Role.CO_WIZARD), (Role.CO_WIZARD, Role.PARTICIPANT)):
                self._write_utterance(listener, speaker, delivered.heard.get(speaker))
                self._write_utterance(Role.AD_WIZARD, speaker, delivered.said.get(speaker))
        self._spoke, self._heard = spoke, heard

    def _write_utterance(self, listener: Role, speaker: Role, utterance: Utterance | None) -> None:
        text = "" if utterance is None else plain_text(utterance.text, MAX_UTTERANCE)
        self._views.set_text(listener, f"{speaker}_text", text)
        table = self._tables[listener]
        if (moves := table.get(f"{speaker}_moves")) is None:
            return  # acts are not observed
        slots = table[f"{speaker}_slots"]
        moves[:], slots[:] = NO_MOVE, 0
        for k, act in enumerate(() if utterance is None else utterance.acts[: len(moves)]):
            moves[k], slots[k] = int(act.move), encode_slots(act.slots)
        self._views.renew(listener, f"{speaker}_moves", f"{speaker}_slots")


_NAMES = {role: str(role) for role in AGENT_ROLES}


# --- observations of a session in progress ----------------------------------------------------------------------------


class SessionObserver:
    """Observations, masks and pictures of a session at the current decision.

    Rows and masks are made when they are first used: not all sessions are observed by dicts or need masks.

    Attributes:
        delivered: speech and messages of the last decision; the session replaces it.
        camera_perception: content of the picture, if the roles perceive by the camera.
        sensors: cameras and sensors of the car, if there are any.
    """

    def __init__(
        self,
        world: World,
        scenario: Scenario,
        task: TaskState,
        beliefs: BeliefTracker,
        config: EnvConfig,
        limits: SpaceLimits,
        delivered: DeliveredMessages,
    ) -> None:
        self._world, self._scenario, self._task, self._beliefs = world, scenario, task, beliefs
        self._config, self._limits, self.delivered = config, limits, delivered
        self.sensors = SensorReadings(world, scenario, config) if config.has_sensors else None
        self.camera_perception: VisiblePerception | None = (
            see_by_camera(world, scenario) if config.perception is PerceptionModel.CAMERA else None
        )

    @cached_property
    def _views(self) -> SessionViews:
        return SessionViews(self._world, RoleArrays(self._limits, self._config.observe_acts), 0)

    @cached_property
    def _builder(self) -> ObservationBuilder:
        return ObservationBuilder(self._views, self._scenario, self._task, self._beliefs)

    @cached_property
    def masks(self) -> ActionMasks:
        """Masks of the actions that would be carried out now."""
        return ActionMasks(self._views, self._task)

    def share_views(self, arrays: RoleArrays, row: int) -> None:
        """Makes the session, which has not been observed yet, write observations and masks into a row of arrays."""
        self._views = SessionViews(self._world, arrays, row)
        self.write()

    def write(self) -> None:
        """Writes the parts of observations and masks that the compiled code leaves out, and its inputs."""
        self._world.write_weather()
        self._builder.write(self.delivered)
        self.masks.write()

    def observe(self) -> None:
        """Writes the observations and masks into the row of the session."""
        self.write()
        self._views.write(EVERYTHING)

    def begin_decision(self) -> None:
        """Lets the sensors note the present before the world is stepped."""
        if self.sensors is not None:
            self.sensors.begin_decision()

    def look(self, events: Sequence[WorldEvent]) -> None:
        """Reads the sensors after a step of the world, and looks at its picture if the roles see by the camera."""
        if self.sensors is not None:
            self.sensors.update(events)
        if self.camera_perception is not None:
            self.camera_perception.look()
            self._beliefs.recognised = self.camera_perception.recognised

    def observations(self, roles: Sequence[Role], decision: int) -> dict[str, Observation]:
        """Builds the observations of the given roles at the decision of a given number, by agent."""
        observations = self._builder.build(self.delivered, roles)
        if self.camera_perception is not None:
            self.camera_perception.add_to(observations)
        if self.sensors is not None:
            self.sensors.add_to(observations, decision)
        return observations

    def views(self, roles: Sequence[Role], decision: int) -> dict[str, Observation]:
        """Returns `observations` as views that are valid until the next decision, see `RowView`."""
        if self.camera_perception is not None or self.sensors is not None:
            return self.observations(roles, decision)
        return self._builder.view(self.delivered, roles)

    def picture(self, decision: int, name: str = "") -> CameraFrame | None:
        """Returns the picture of a camera on the car, boxes included; None without such a camera."""
        return None if self.sensors is None else self.sensors.picture(decision, name)


# --- observations on demand -------------------------------------------------------------------------------------------

_AGENTS = {str(role): role for role in AGENT_ROLES}


class Observable(Protocol):
    """Session whose roles can be observed; `decisions` is the number of decisions played so far."""

    decisions: int
    observer: SessionObserver

    def observations(self, roles: Sequence[Role]) -> dict[str, Observation]:
        """Builds the observations of the given roles at the current decision, by agent."""
        ...


class LazyObservations(Mapping[str, Observation]):
    """Observations of the roles at one decision, each built when it is first read.

    A mapping is valid until the session takes its next step: it raises `RuntimeError` when an observation that was not
    read in time is requested afterwards.
    """

    def __init__(self, session: Observable) -> None:
        self._session, self._decision = session, session.decisions
        self._built: dict[str, Observation] = {}

    def __getitem__(self, agent: str) -> Observation:
        return self.of((_AGENTS[agent],))[agent]

    def __iter__(self) -> Iterator[str]:
        return iter(_AGENTS)

    def __len__(self) -> int:
        return len(_AGENTS)

    def views(self, roles: Sequence[Role]) -> dict[str, Observation]:
        """Returns the observations of the given roles by agent, as views that the next step changes, see `RowView`."""
        if self._session.decisions != self._decision:
            raise RuntimeError("the session has taken a step since; its views show another decision")
        return self._session.observer.views(roles, self._decision)

    def of(self, roles: Sequence[Role] = AGENT_ROLES) -> dict[str, Observation]:
        """Returns the observations of the given roles by agent; missing ones are built together."""
        missing = [role for role in roles if role not in self._built] if self._built else roles
        if not missing:
            return {str(role): self._built[role] for role in roles}
        if self._session.decisions != self._decision:
            raise RuntimeError(f"the session has taken a step since; the observation of {missing[0]} was not read")
        found = self._session.observations(missing)
        self._built.update(found)
        return found if missing is roles else {str(role): self._built[role] for role in roles}
