"""PettingZoo's turn-based form of `DuoWizard-v0`: the three agents act one after the other in each decision."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from dorothie_gym.session.spaces.actions import ActionDict
from dorothie_gym.session.spaces.observations import Observation

if TYPE_CHECKING:
    from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
    from dorothie_gym.support.copying import State


class TurnBasedDuoWizard(parallel_to_aec_wrapper[str, Observation, ActionDict | None]):
    """PettingZoo's turn-based form of a `DuoWizardEnv`, whose states hold whose turn it is and the actions so far."""

    env: DuoWizardEnv

    def __init__(self, parallel: DuoWizardEnv) -> None:
        # PettingZoo declares actions that may be None, for agents that are done
        super().__init__(parallel)  # pyright: ignore[reportArgumentType]
        self._constant = frozenset((*vars(self), "_constant"))
        parallel.turns = self

    def clone_state(self) -> State:
        """Returns the current state, see `DuoWizardEnv.clone_state`."""
        return self.env.clone_state()

    def restore_state(self, state: State) -> None:
        """Goes back to a state, see `DuoWizardEnv.restore_state`."""
        self.env.restore_state(state)

    def turn_values(self) -> dict[str, object]:
        """Returns the state outside the session: whose turn it is, actions of the others, results not yet returned."""
        return {name: value for name, value in vars(self).items() if name not in self._constant}

    def apply_turn_values(self, values: dict[str, object]) -> None:
        """Applies the values that `turn_values` has returned."""
        for name in self.turn_values():
            delattr(self, name)
        self.__dict__.update(values)
