"""Observations and action masks of sessions in arrays, one row for each session."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple, TypeAlias, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.spaces.actions import action_space
from dorothie_gym.session.spaces.fields import AnySpace, Arrays, FieldBuffer, Shape, SpaceLimits
from dorothie_gym.session.spaces.observations import ExitColumn, Observation, observation_space
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import CachedViews, shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

Integers: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.int8]
"""Mask of one field: 1 for values that would be accepted."""


# --- Fields that change at every decision: the compiled code writes them --------------------------------------------


@by_reference
class ParticipantArrays(NamedTuple):
    """Fields of the participants' observations; names and shapes of the rows are those of `observation_fields`."""

    time: Array
    speed: Array
    pose: Array
    lane: Integers
    station: Array
    sight: Array
    lights: Integers
    objects: Array


@by_reference
class CoWizardArrays(NamedTuple):
    """Fields of the Co-Wizards' observations, see `ParticipantArrays`."""

    time: Array
    speed: Array
    pose: Array
    lane: Integers
    station: Array
    sight: Array
    pose_covariance: Array
    cruise_speed: Array
    lights: Integers
    motion: Integers
    hazard: Integers
    hazard_distance: Array
    manoeuvre: Integers
    manoeuvre_angle: Array
    waypoints: Array
    exits: Array
    objects: Array


@by_reference
class AdWizardArrays(NamedTuple):
    """Fields of the Ad-Wizards' observations, see `ParticipantArrays`."""

    time: Array
    speed: Array
    pose: Array
    lane: Integers
    station: Array
    motion: Integers
    waypoints: Array
    path_lanes: Integers


@by_reference
class MaskArrays(NamedTuple):
    """Fields of the Co-Wizards' action masks; names and shapes of the rows are those of `action_fields`."""

    physical: Mask
    angle: Mask


class ViewArrays(NamedTuple):
    """Output of the compiled code at a decision: observations of the three roles, and masks."""

    participant: ParticipantArrays
    co_wizard: CoWizardArrays
    ad_wizard: AdWizardArrays
    masks: MaskArrays


_Named = TypeVar("_Named", bound=tuple[Any, ...])


def _named(kind: type[_Named], arrays: Arrays) -> _Named:
    names: tuple[str, ...] = vars(kind)["_fields"]
    return kind(*(arrays[name] for name in names))


# --- All rows ---------------------------------------------------------------------------------------------------------


class RoleArrays(CachedViews):
    """Observations and action masks of sessions, by role: arrays with a row for each session, and their texts.

    Attributes:
        observations: buffers of the numbers in the observations.
        masks: buffers of the masks.
        texts: texts in the observations by field, one for each session.
        unmasked: names of the action fields without a mask.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("written",)

    def __init__(self, limits: SpaceLimits, observe_acts: bool, rows: int = 1) -> None:
        """Makes rows of zeros.

        Args:
            limits: sizes of the spaces.
            observe_acts: whether dialogue acts are observed.
            rows: number of sessions.
        """
        self.observations: dict[Role, FieldBuffer] = {}
        self.masks: dict[Role, FieldBuffer] = {}
        self.texts: dict[Role, dict[str, list[str]]] = {}
        self.unmasked: dict[Role, tuple[str, ...]] = {}
        for role in AGENT_ROLES:
            observed = observation_space(role, limits, observe_acts)
            self.observations[role] = FieldBuffer.of_space(observed, rows)
            texts = [name for name, space in observed.spaces.items() if isinstance(space, spaces.Text)]
            self.texts[role] = {name: [""] * rows for name in texts}
            shapes = _mask_shapes(role, limits)
            self.unmasked[role] = tuple(name for name, shape in shapes.items() if shape is None)
            masked = {name: (np.int8, shape) for name, shape in shapes.items() if shape is not None}
            self.masks[role] = FieldBuffer(masked, rows)

    @cached_property
    def written(self) -> ViewArrays:
        """Output of the compiled code, in all rows."""
        observed = {role: buffer.arrays for role, buffer in self.observations.items()}
        return ViewArrays(
            _named(ParticipantArrays, observed[Role.PARTICIPANT]),
            _named(CoWizardArrays, observed[Role.CO_WIZARD]),
            _named(AdWizardArrays, observed[Role.AD_WIZARD]),
            _named(MaskArrays, self.masks[Role.CO_WIZARD].arrays),
        )

    def written_row(self, row: int) -> ViewArrays:
        """Returns one row of the compiled code's output, as arrays with a single row."""
        return ViewArrays._make(type(part)._make(array[row : row + 1] for array in part) for part in self.written)

    def observation(self, role: Role, row: int) -> Observation:
        """Returns the observation of a role in a session, which the caller owns."""
        observed: Observation = self.observations[role].copy_row(row)
        for name, texts in self.texts[role].items():
            observed[name] = texts[row]
        return observed

    def clear(self, row: int) -> None:
        """Clears a session: its observations become zeros and empty texts."""
        for role, buffer in self.observations.items():
            buffer.clear(row)
            for texts in self.texts[role].values():
                texts[row] = ""


class RowView:
    """Observation of a role in one session as views of its arrays, for policies that keep no part of it.

    Values that change at every decision are read-only views, and hold the next decision's values after it. All other
    arrays and texts are the same objects until Python has written them again.
    """

    def __init__(self, arrays: RoleArrays, role: Role, row: int) -> None:
        """Looks up a row.

        Args:
            arrays: observations of all sessions.
            role: the role.
            row: number of the session.
        """
        self._row, self._texts = row, arrays.texts[role]
        self._tables = arrays.observations[role].arrays
        self._numbers = tuple((name, array) for name, array in self._tables.items() if array.ndim == 1)
        changing = frozenset((*vars(_WRITTEN[role])["_fields"], *SPEAKING))
        tables = {name: array for name, array in self._tables.items() if array.ndim > 1}
        self._content: Observation = {
            name: _read_only(array[row]) for name, array in tables.items() if name in changing
        }
        self.renew([name for name in (*tables, *self._texts) if name not in changing])

    def refreshed(self) -> Observation:
        """Returns the observation with the numbers of the current decision; the same mapping each time."""
        row, content = self._row, self._content
        for name, array in self._numbers:
            content[name] = array.item(row)
        return content

    def renew(self, fields: Iterable[str]) -> None:
        """Replaces fields that are no views, after a change."""
        for name in fields:
            if name in self._texts:
                self._content[name] = self._texts[name][self._row]
            else:
                self._content[name] = _read_only(self._tables[name][self._row].copy())


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Returns a view of an array that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


SPEAKING: Final = ("speaking", "other_speaking")
"""Fields that Python writes at every decision while there is talk."""

_WRITTEN: Final[Mapping[Role, type[tuple[Any, ...]]]] = {
    Role.PARTICIPANT: ParticipantArrays,
    Role.CO_WIZARD: CoWizardArrays,
    Role.AD_WIZARD: AdWizardArrays,
}


@lru_cache(maxsize=64)
def _mask_shapes(role: Role, limits: SpaceLimits) -> Mapping[str, Shape | None]:
    """Returns the shape of the mask of each action field; None for fields without a mask."""
    return {name: _mask_shape(space) for name, space in action_space(role, limits).spaces.items()}


def _mask_shape(space: AnySpace) -> Shape | None:
    """Returns the shape of a field's mask; all entries of a multi-discrete field have the same number of choices."""
    if isinstance(space, spaces.Discrete):
        return (int(space.n),)
    if isinstance(space, spaces.MultiDiscrete):
        return len(space.nvec), int(space.nvec[0])
    return None


# --- Turn options of a town -------------------------------------------------------------------------------------------


@by_reference
@shared
class TurnOptions(NamedTuple):
    """Exits after each lane of a town.

    Attributes:
        first: (lanes + 1,) int32 first row of each lane's exits, and the one after the last.
        rows: (n, 6) the exits from right to left, columns `ExitColumn` without the distance.
    """

    first: NDArray[np.int32]
    rows: Array


@lru_cache(maxsize=16)
def turn_options(town: Town) -> TurnOptions:
    """Returns the turn options of a town."""
    numbers = town.junction_indices
    exits = [town.exits(lane.id) for lane in town.lanes]
    rows = [
        (1.0, way.angle, 0.0, way.lane, town.lanes[way.lane].street, numbers.get(way.junction_id, -1))
        for ways in exits
        for way in ways
    ]
    first = np.cumsum([0, *map(len, exits)], dtype=np.int32)
    return TurnOptions(first, np.array(rows, dtype=np.float64).reshape(-1, len(ExitColumn)))
