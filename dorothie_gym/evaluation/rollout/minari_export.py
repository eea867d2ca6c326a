"""Recorded sessions as datasets of one role for Minari and readers of Minari's datasets (TorchRL, d3rlpy).

As in `hugging_face_export`, a dataset contains no data of the other roles, and nothing from which they could be
derived: episodes have neither names nor seeds, and the environment of the dataset draws new sessions.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import asdict, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec, WrapperSpec

from dorothie_gym._version import __version__
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.hugging_face_export import dataset_card
from dorothie_gym.evaluation.rollout.role_episodes import RoleEpisode
from dorothie_gym.maps.catalogue import town_names
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces.actions import noop
from dorothie_gym.session.spaces.flat import FlatActions, FlatObservations
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from minari.data_collector import EpisodeBuffer

    from dorothie_gym.session.spaces.fields import AnySpace

MINARI_FOLDER: Final = "MINARI_DATASETS_PATH"
"""Environment variable with the folder of Minari's datasets."""

STORAGES: Final = ("hdf5", "arrow")
"""Minari's formats of files: TorchRL reads HDF5 only."""

_IDS: Final[Mapping[Role, str]] = {
    Role.PARTICIPANT: "Participant-v0",
    Role.CO_WIZARD: "CoWizard-v0",
    Role.AD_WIZARD: "AdWizard-v0",
}


def export_minari(
    episodes: Iterable[RoleEpisode],
    role: Role,
    folder: Path | str,
    on_session: Callable[[], None] | None = None,
    *,
    storage: str = STORAGES[0],
    fields: Sequence[str] = (),
) -> str:
    """Writes a dataset for Minari, an episode for each session, with its card as description.

    Episodes are in the order of their ids, and have the masks of the actions as `infos["action_mask"]`. The dataset
    names an environment of the role with the settings of the sessions, for `recover_environment()`.

    Args:
        episodes: sessions of the role, with spaces of the same sizes.
        role: the role.
        folder: folder of Minari's datasets (`MINARI_DATASETS_PATH`).
        on_session: called after each session.
        storage: one of `STORAGES`.
        fields: fields of the action to keep in a vector; observations are then also vectors, as from
            `dorothie_gym.flatten`. None keeps all fields as they are.

    Returns:
        Name of the dataset: "dorothie-gym/ROLE-v0".

    Raises:
        SessionError: Minari is not installed, there are no sessions, their spaces differ, a field is unknown, or the
            dataset exists.
    """
    _check_libraries(storage)
    import minari

    name, found = f"dorothie-gym/{str(role).replace('_', '-')}-v0", list[RoleEpisode]()
    for episode in episodes:
        if not episode.actions:
            raise SessionError(f"{episode.source}: has no decisions")
        found.append(episode)
        if on_session is not None:
            on_session()
    if not found:
        raise SessionError("there are no sessions to export")
    _check_equal(found)
    if (Path(folder) / name).exists():
        raise SessionError(f"{Path(folder) / name}: exists already; choose another folder, or remove it first")
    form = _Vectors(role, found[0], fields) if fields else _Dicts(found[0])
    found.sort(key=lambda episode: episode.id)
    buffers = [_buffer(number, episode, form) for number, episode in enumerate(found)]
    Path(folder).mkdir(parents=True, exist_ok=True)
    with _environment(MINARI_FOLDER, str(Path(folder).resolve())), warnings.catch_warnings():
        # it misses an environment for evaluations, and that of towns that are not shipped
        warnings.filterwarnings("ignore", category=UserWarning, module="minari")
        minari.create_dataset_from_buffers(
            name,
            buffers,
            env=_env_spec(role, found, form),
            observation_space=form.observation_space,
            action_space=form.action_space,
            algorithm_name="recorded sessions",
            author="dorothie_gym",
            author_email="none",
            code_permalink=f"dorothie-gym {__version__}",
            description=_description(role, found, form),
            requirements=[f"dorothie-gym=={__version__}"],
            data_format=storage,
            jpeg_encoding=False,
        )
    return name


def _check_libraries(storage: str) -> None:
    if storage not in STORAGES:
        raise SessionError(f"storage is {storage!r}; it must be {' or '.join(STORAGES)}")
    if find_spec("minari") is None or (storage == "hdf5" and find_spec("h5py") is None):
        missing = "Minari" if find_spec("minari") is None else "h5py, which writes HDF5,"
        raise SessionError(f"{missing} is not installed; run: {pip_install('minari')}")


def _check_equal(found: Sequence[RoleEpisode]) -> None:
    first = found[0]
    for other in found:
        if (other.observation_space, other.action_space) != (first.observation_space, first.action_space):
            raise SessionError(f"{other.source}: its spaces have other sizes than those of {first.source}")


# --- Forms of the data ------------------------------------------------------------------------------------------------


class _Dicts:
    """Observations, actions and masks by field, as in the environment."""

    wrappers: tuple[WrapperSpec, ...] = ()

    def __init__(self, first: RoleEpisode) -> None:
        self.observation_space: AnySpace = first.observation_space
        self.action_space: AnySpace = first.action_space

    def observations(self, episode: RoleEpisode) -> Any:
        """Returns the observations of an episode, (n + 1, ...) each field."""
        return _stacked(episode.observations)

    def actions(self, episode: RoleEpisode) -> Any:
        """Returns the actions of an episode, (n, ...) each field."""
        return _stacked(episode.actions)

    def masks(self, episode: RoleEpisode) -> Any:
        """Returns the masks of an episode, (n + 1, ...) each field that has one."""
        masked = [name for name, mask in episode.masks[0].items() if mask is not None]
        return _stacked([{name: mask[name] for name in masked} for mask in episode.masks])


class _Vectors:
    """Observations and actions as vectors, as `dorothie_gym.flatten` makes them; masks have an entry for each value."""

    plain = (
        WrapperSpec("FilterObservation", "gymnasium.wrappers:FilterObservation", {"filter_keys": ["observation"]}),
        WrapperSpec("FlattenObservation", "gymnasium.wrappers:FlattenObservation", {}),
    )

    def __init__(self, role: Role, first: RoleEpisode, fields: Sequence[str]) -> None:
        self._seen = FlatObservations(first.observation_space)
        try:
            self._done = FlatActions(first.action_space, fields, noop(role, first.limits))
        except ValueError as error:
            raise SessionError(str(error)) from None
        self.observation_space: AnySpace = spaces.Box(self._seen.low, self._seen.high, dtype=np.float32)
        # TorchRL's reader knows no MultiDiscrete
        self.action_space: AnySpace = spaces.Box(np.zeros_like(self._done.nvec), self._done.nvec - 1, dtype=np.int64)
        flat = "dorothie_gym.wrappers.flatten:Flatten"
        self.wrappers = (
            WrapperSpec("FlattenAction", f"{flat}Action", {"fields": list(fields)}),
            WrapperSpec("FlattenObservation", f"{flat}Observation", {}),
            *self.plain,
        )

    @property
    def entries(self) -> Mapping[str, int]:
        """Number of entries of each field of the action, in order."""
        return {name: len(sizes) for name, sizes in self._done.sizes.items()}

    def observations(self, episode: RoleEpisode) -> Any:
        """Returns the observations of an episode (n + 1, m) float32."""
        return np.stack([self._seen.vector(observation) for observation in episode.observations])

    def actions(self, episode: RoleEpisode) -> Any:
        """Returns the actions of an episode (n, k) int64."""
        return np.stack([self._done.vector(action) for action in episode.actions])

    def masks(self, episode: RoleEpisode) -> Any:
        """Returns the masks of an episode (n + 1, number of values) int8."""
        return np.stack([self._done.mask(mask) for mask in episode.masks]).astype(np.int8)


def _buffer(number: int, episode: RoleEpisode, form: _Dicts | _Vectors) -> EpisodeBuffer:
    from minari.data_collector import EpisodeBuffer

    ends = [False] * (len(episode.actions) - 1)
    return EpisodeBuffer(
        id=number,
        observations=form.observations(episode),
        actions=form.actions(episode),
        rewards=list(episode.rewards),
        terminations=[*ends, episode.terminated],
        truncations=[*ends, not episode.terminated],
        infos={"action_mask": form.masks(episode)},
    )


def _stacked(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the values of each field of several rows: arrays, lists of texts, and tuples of arrays."""
    return {name: _column([row[name] for row in rows]) for name in rows[0]}


def _column(values: Sequence[Any]) -> Any:
    if isinstance(values[0], str):
        return list(values)
    if isinstance(values[0], tuple):
        return tuple(_column(part) for part in zip(*values, strict=True))
    return np.stack([np.asarray(value) for value in values])


# --- What describes the data ------------------------------------------------------------------------------------------


def _env_spec(role: Role, found: Sequence[RoleEpisode], form: _Dicts | _Vectors) -> EnvSpec | None:
    """Returns the specification of an environment with the spaces and settings of the sessions.

    It draws sessions of its own: it has neither a storyboard nor a seed. Where the sessions have different towns or
    settings, it has the first town, and the usual value of a setting. None if no town is shipped.
    """
    towns = sorted({episode.town for episode in found} & set(town_names()))
    if not towns:
        return None
    spec = deepcopy(gym.spec(f"dorothie_gym/{_IDS[role]}"))
    spec.kwargs |= {"town": towns[0], "config": _common_settings([episode.config for episode in found])}
    spec.additional_wrappers = form.wrappers
    return spec


def _common_settings(configs: Sequence[EnvConfig]) -> dict[str, object]:
    """Returns the settings that all configurations share, in JSON types, without the usual ones."""
    usual, first = EnvConfig(), replace(configs[0], camera=None)
    shared = {
        name: value
        for name, value in vars(first).items()
        if value != getattr(usual, name) and all(getattr(config, name) == value for config in configs)
    }
    return {name: value for name, value in asdict(first).items() if name in shared}


def _description(role: Role, found: Sequence[RoleEpisode], form: _Dicts | _Vectors) -> str:
    towns, decisions = sorted({episode.town for episode in found}), sum(len(episode.actions) for episode in found)
    lines = dataset_card(role, len(found), decisions, towns, found[0].limits, "", "")
    if isinstance(form, _Vectors):
        entries = ", ".join(f"`{name}` {count}" for name, count in form.entries.items())
        lines += [
            "",
            "Observations are vectors of the numbers of all fields, in alphabetical order of their names. Actions "
            f"are vectors with these fields, and so many entries each: {entries}.",
        ]
    return "\n".join(lines)


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Sets an environment variable as long as the block lasts."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
