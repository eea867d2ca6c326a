"""Wrapper that records the sessions of an environment; the environment is unaware of the recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from pettingzoo import ParallelEnv
from pettingzoo.utils import BaseParallelWrapper

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.session.recorder import SessionRecorder
from dorothie_gym.session.recording.writer import SessionWriter
from dorothie_gym.session.spaces.actions import ActionDict, StepInfo
from dorothie_gym.session.spaces.observations import Observation

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import Event
    from dorothie_gym.session.recording.header import SessionHeader

ResetResult: TypeAlias = tuple[dict[str, Observation], dict[str, StepInfo]]
StepResult: TypeAlias = tuple[
    dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, StepInfo]
]


class Recordable(Protocol):
    """Interface of recordable environments, implemented by `DuoWizardEnv`."""

    @property
    def last_events(self) -> tuple[Event, ...]:
        """Events of the last step, or of the reset."""
        ...

    @property
    def last_frames(self) -> NDArray[np.float64]:
        """Trajectory rows (n, 9) of the last step, or of the reset; columns as in `TRAJECTORY_COLUMNS`."""
        ...

    def session_header(self) -> SessionHeader:
        """Returns the header of the session; called after each reset."""
        ...

    def summary(self) -> Mapping[str, object]:
        """Returns the outcome of the session in JSON types; called when all agents are done."""
        ...


def name_by_seed(header: SessionHeader) -> str:
    """Returns `seed_<seed>`."""
    return f"seed_{header.seed}"


class RecordSession(BaseParallelWrapper):
    """Wrapper that writes one session folder per reset; observations and actions pass unchanged.

    Sessions of a `DuoWizardEnv` include the decisions of the roles and the surroundings of the car; sessions of other
    environments consist of events and frames. An incomplete session (another reset, `close`, end of the process) can be
    read up to its last decision.

    Args:
        env: parallel environment whose `unwrapped` is `Recordable`.
        folder: parent folder of the session folders.
        name: function from the header to the name of the session folder; `"."` records into `folder` itself.
        overwrite: whether an existing session of the same name is deleted.

    Raises:
        SessionError: on reset, if the folder contains a session and `overwrite` is False.
    """

    def __init__(
        self,
        env: ParallelEnv[str, Observation, ActionDict],
        folder: Path | str,
        *,
        name: Callable[[SessionHeader], str] = name_by_seed,
        overwrite: bool = False,
    ) -> None:
        super().__init__(env)
        self.folder = Path(folder)
        self._name = name
        self._overwrite = overwrite
        self._writer: SessionWriter | None = None
        self._recorder: SessionRecorder | None = None
        self._session_folder: Path | None = None

    @property
    def session_folder(self) -> Path | None:
        """Folder of the current or last session; None before the first reset."""
        return self._session_folder

    def reset(self, seed: int | None = None, options: dict[str, object] | None = None) -> ResetResult:
        """Resets the environment and creates the folder of the next session."""
        self._close_writer()
        result: ResetResult = super().reset(seed=seed, options=options)
        header = self._recorded.session_header()
        self._session_folder = self.folder / self._name(header)
        self._writer = SessionWriter(self._session_folder, header, overwrite=self._overwrite)
        if isinstance(self.env.unwrapped, DuoWizardEnv):
            self._recorder = SessionRecorder(self.env.unwrapped.engine, self._writer)
        else:
            self._append()
        return result

    def step(self, actions: dict[str, ActionDict]) -> StepResult:
        """Steps the environment, records the step, and finishes the session when all agents are done."""
        result: StepResult = super().step(actions)
        if self._recorder is not None:
            self._recorder.record(actions)
        else:
            self._append()
        if self._writer is not None and not self.env.agents:
            self._writer.finish(self._recorded.summary())
            self._writer = self._recorder = None
        return result

    def close(self) -> None:
        """Closes the files and the environment."""
        self._close_writer()
        super().close()

    @property
    def _recorded(self) -> Recordable:
        return cast("Recordable", self.env.unwrapped)

    def _append(self) -> None:
        if self._writer is not None:
            self._writer.append(self._recorded.last_events, self._recorded.last_frames)

    def _close_writer(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = self._recorder = None
