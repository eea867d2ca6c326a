"""Row of a session in the arrays of observations and masks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.session.view_arrays import RoleArrays, turn_options
from dorothie_gym.session.view_steps import Wanted, observe_share
from dorothie_gym.sim.batch.threads import turns_of
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.world import World
from dorothie_gym.support.compilation import direct
from dorothie_gym.support.copying import CachedViews

_observe_share = direct(observe_share)
_FLAGS = dict(zip(AGENT_ROLES, map(int, (Wanted.PARTICIPANT, Wanted.CO_WIZARD, Wanted.AD_WIZARD)), strict=True))
_MASKS = int(Wanted.MASKS)


class SessionViews(CachedViews):
    """Row of a session in the arrays of observations and masks, which compiled code fills in.

    Attributes:
        world: world of the session.
        arrays: arrays of all sessions.
        row: number of the row.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_call", "_called_with")

    _called_with: WorldArrays | None = None

    def __init__(self, world: World, arrays: RoleArrays, row: int) -> None:
        self.world, self.arrays, self.row = world, arrays, row

    @property
    def most_props(self) -> int:
        """Largest number of props."""
        return len(self.arrays.observations[Role.AD_WIZARD].arrays["props"][self.row])

    def observe(self, roles: Sequence[Role]) -> None:
        """Writes the part of observations that changes at every decision."""
        self.write(sum([_FLAGS[role] for role in roles]))

    def find_feasible(self) -> None:
        """Writes the masks of the Co-Wizard's physical actions."""
        self.write(_MASKS)

    def write(self, wanted: int) -> None:
        """Writes values that change at every decision; `wanted` are flags of `view_steps.Wanted`."""
        arrays = self.world.sensing_arrays
        if arrays is not self._called_with:
            town = self.world.actors.town_arrays, turn_options(self.world.town)
            self._called_with = arrays
            self._call = turns_of(1, 1), 0, *town, self.world.batch, *self.arrays.written_row(self.row)
        self._call[0][0, 0] = 0
        _observe_share(*self._call, wanted)

    def tables(self) -> dict[Role, Observation]:
        """Returns the arrays of the row, by role and field."""
        return {
            role: {name: array[self.row] for name, array in buffer.arrays.items() if array.ndim > 1}
            for role, buffer in self.arrays.observations.items()
        }

    def set_text(self, role: Role, field: str, text: str) -> None:
        """Writes a text of an observation."""
        self.arrays.texts[role][field][self.row] = text
