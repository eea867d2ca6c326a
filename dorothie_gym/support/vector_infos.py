"""Conventions of Gymnasium's vector environments: seeds, reset masks, and the layout of infos."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Infos: TypeAlias = dict[str, Any]
"""Infos of a batch: under `name` an array (num_envs, ...) or the infos of a nested dict, under `_name` a mask of the
environments that have it.
"""


def seeds_of(seed: int | Sequence[int | None] | None, count: int) -> Sequence[int | None]:
    """Returns a seed for each of `count` environments.

    Args:
        seed: seed of the first environment, of which the others count up; or a seed for each; None for no seeds.
        count: number of environments.

    Raises:
        ValueError: there is not one seed for each environment.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + i for i in range(count)]
    if len(seed) != count:
        raise ValueError(f"{len(seed)} seeds for {count} environments")
    return seed


def mask_of(mask: object, count: int) -> NDArray[np.bool_]:
    """Returns the option `reset_mask` of a reset, (count,); None for all environments.

    Raises:
        ValueError: it is of another shape or type.
    """
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    if not isinstance(mask, np.ndarray) or mask.shape != (count,) or mask.dtype != np.bool_:
        raise ValueError(f"reset_mask must be a bool array of the shape ({count},)")
    return mask


def masked_infos(values: Mapping[str, NDArray[np.generic] | Infos], mask: NDArray[np.bool_]) -> Infos:
    """Returns the infos of the environments of a mask: as `SyncVectorEnv`, zeros for the others.

    Args:
        values: arrays (num_envs, ...), or nested infos, by name.
        mask: (num_envs,).
    """
    infos: Infos = {}
    if not mask.any():
        return infos
    all_have = mask.all()
    for name, value in values.items():
        if isinstance(value, np.ndarray) and all_have:
            infos[name] = value.copy()
        elif isinstance(value, np.ndarray):
            masked = np.full_like(value, None) if value.dtype == np.object_ else np.zeros_like(value)
            masked[mask] = value[mask]
            infos[name] = masked
        else:
            infos[name] = value
        infos[f"_{name}"] = mask.copy()
    return infos
