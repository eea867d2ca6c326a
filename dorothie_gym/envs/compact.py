"""Actions of a decision, written down without what says nothing, and put together again."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from gymnasium import spaces

from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.sessions import Decision, SessionError
from dorothie_gym.spaces import ActionDict, SpaceLimits, action_space, noop


@lru_cache(maxsize=16)
def _idle(role: Role, limits: SpaceLimits) -> ActionDict:
    return noop(role, limits)


@lru_cache(maxsize=16)
def _arrays(role: Role, limits: SpaceLimits) -> frozenset[str]:
    return frozenset(name for name, value in _idle(role, limits).items() if isinstance(value, np.ndarray))


def compact(actions: Mapping[str, Mapping[str, Any]], limits: SpaceLimits) -> dict[Role, dict[str, Any]]:
    """Returns actions as a `Decision` keeps them.

    Args:
        actions: actions of the roles that the environment has taken, by agent.
        limits: sizes of its spaces.
    """
    found = {}
    for role in AGENT_ROLES:
        idle, arrays = _idle(role, limits), _arrays(role, limits)
        fields: dict[str, Any] = {}
        for name, value in actions[str(role)].items():
            if name in arrays:
                values = np.asarray(value)
                if values.any():
                    fields[name] = _short(values, _is_flags(role, name, limits))
            elif value != idle[name]:
                fields[name] = value if isinstance(value, str) else int(value)
        if fields:
            found[role] = fields
    return found


def expand(decision: Decision, limits: SpaceLimits) -> dict[str, ActionDict]:
    """Returns the actions of a decision as the environment takes them, by agent.

    Raises:
        SessionError: a role has no such field, or it holds what it cannot hold.
    """
    return {str(role): _expanded(decision, role, limits) for role in AGENT_ROLES}


def idle_actions(limits: SpaceLimits) -> dict[str, ActionDict]:
    """Returns the actions of a decision in which nobody does anything, by agent."""
    return {str(role): _idle(role, limits) for role in AGENT_ROLES}


def _short(values: np.ndarray[Any, Any], flags: bool) -> list[int]:
    places = np.flatnonzero(values)
    short: list[int] = places.tolist() if flags else values[: int(places[-1]) + 1].tolist()
    return short


def _expanded(decision: Decision, role: Role, limits: SpaceLimits) -> ActionDict:
    idle = _idle(role, limits)
    fields = decision.actions.get(role)
    if not fields:
        return idle
    action = dict(idle)
    for name, value in fields.items():
        where = f"decision at frame {decision.frame}, {role}: field {name!r}"
        if name not in idle:
            raise SessionError(f"{where} is none of {', '.join(idle)}")
        if isinstance(idle[name], np.ndarray):
            value = _long(value, idle[name], _is_flags(role, name, limits), where)
        action[name] = value
    return action


def _long(value: Any, idle: np.ndarray[Any, Any], flags: bool, where: str) -> np.ndarray[Any, Any]:
    array = idle.copy()
    if not isinstance(value, list | tuple) or not all(type(item) is int and 0 <= item < 2**31 for item in value):
        raise SessionError(f"{where} must be a list of whole numbers")
    if (max(value, default=0) if flags else len(value) - 1) >= len(array):
        raise SessionError(f"{where} goes beyond the {len(array)} places that there are")
    if flags:
        array[list(value)] = 1
    else:
        array[: len(value)] = value
    return array


@lru_cache(maxsize=256)
def _is_flags(role: Role, name: str, limits: SpaceLimits) -> bool:
    """Whether the field is an array of 0 and 1."""
    return isinstance(action_space(role, limits)[name], spaces.MultiBinary)
