"""Recording what happens in an environment, which does not know that it is recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from pettingzoo import ParallelEnv
from pettingzoo.utils import BaseParallelWrapper

from dorothie_gym.engine.recorder import SessionRecorder
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.recording import Event, SessionHeader, SessionWriter

ResetResult: TypeAlias = tuple[dict[Any, Any], dict[Any, dict[str, Any]]]
StepResult: TypeAlias = tuple[
    dict[Any, Any], dict[Any, float], dict[Any, bool], dict[Any, bool], dict[Any, dict[str, Any]]
]


class Recordable(Protocol):
    """What an environment shows to a recorder (`DuoWizardEnv` does)."""

    @property
    def last_events(self) -> tuple[Event, ...]:
        """What happened in the last step, or in the reset."""

    @property
    def last_frames(self) -> NDArray[np.float64]:
        """Rows (n, 9) of the trajectory in the last step, or in the reset; columns as in `TRAJECTORY_COLUMNS`."""

    def session_header(self) -> SessionHeader:
        """What is known of the session before it begins; asked after each reset."""

    def summary(self) -> Mapping[str, Any]:
        """How the session ended, in JSON types; asked when all agents are done."""


def name_by_seed(header: SessionHeader) -> str:
    """Returns `seed_<seed>`."""
    return f"seed_{header.seed}"


class RecordSession(BaseParallelWrapper):
    """Writes a session folder for each reset of the environment inside; observations and actions pass unchanged.

    Of a `DuoWizardEnv` also the decisions of the roles and what is around the car are written, of others events and
    frames.

    A session that is not played to its end (another reset, `close`, the death of the process) is left as it is, to be
    read up to the last decision.

    Args:
        env: a parallel environment whose `unwrapped` is `Recordable`.
        folder: folder for the sessions' folders.
        name: name of a session's folder from its header; `"."` records into `folder` itself.
        overwrite: whether a session of the same name is deleted.

    Raises:
        SessionError: on reset, where the folder holds a session and `overwrite` is False.
    """

    def __init__(
        self,
        env: ParallelEnv[Any, Any, Any],
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
        """Folder of the session that is played, or was last; None before the first reset."""
        return self._session_folder

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> ResetResult:
        """Resets the environment and opens the folder of the next session."""
        self._close_writer()
        result: ResetResult = super().reset(seed=seed, options=options)
        header = self._recorded.session_header()
        self._session_folder = self.folder / self._name(header)
        self._writer = SessionWriter(self._session_folder, header, overwrite=self._overwrite)
        if isinstance(self.env.unwrapped, DuoWizardEnv):
            self._recorder = SessionRecorder(self.env.unwrapped, self._writer)
        else:
            self._append()
        return result

    def step(self, actions: dict[Any, Any]) -> StepResult:
        """Steps the environment, appends what happened, and finishes the session when all agents are done."""
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
