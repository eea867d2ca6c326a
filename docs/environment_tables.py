"""Tables on the pages of the environments: fields of spaces, columns, actions, and terms of rewards."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import gymnasium as gym
from highway_env.envs.common.action import DiscreteMetaAction

from dorothie_gym.envs.navigation_continuous_v0 import ACCELERATION_SPECS, CONTROL_SPECS
from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction, Role
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.policies.navigation.actions import physical_of
from dorothie_gym.policies.navigation.driver_view import driver_arrays
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from dorothie_gym.session.spaces import Column, FieldKind, FieldSpec, SpaceLimits

LIMITS = SpaceLimits()
"""Sizes of the spaces on the pages."""


def table(rows: Iterable[tuple[str, ...]], *head: str) -> list[str]:
    """Returns the lines of a Markdown table."""
    return ["| " + " | ".join(row) + " |" for row in (head, tuple("---" for _ in head), *rows)]


def field_tables(specs: Iterable[FieldSpec]) -> list[str]:
    """Returns the table of the fields of a `Dict` space, followed by a table of the columns of each table field."""
    specs = tuple(specs)
    rows = ((f"`{spec.name}`", _shape(spec), spec.dtype, spec.range, spec.unit, spec.meaning) for spec in specs)
    lines = table(rows, "field", "shape", "dtype", "range", "unit", "meaning")
    for spec in specs:
        if spec.columns is not None:
            lines += ["", f"Columns of `{spec.name}`:", "", *column_table(spec.columns)]
    return lines


def column_table(columns: type[Column]) -> list[str]:
    """Returns the table of the columns of a table field."""
    rows = ((str(int(column)), f"`{column.name}`", column.unit, column.meaning) for column in columns)
    return table(rows, "column", f"`{columns.__name__}`", "unit", "meaning")


def vector_table(specs: Iterable[FieldSpec]) -> list[str]:
    """Returns the table of the fields of a vector (`Box` of float32), with their positions."""
    rows, start = [], 0
    for spec in specs:
        end = start + spec.shape[0]
        positions = str(start) if end == start + 1 else f"{start} to {end - 1}"
        rows.append((f"`{spec.name}`", positions, _shape(spec), "float32", spec.range, spec.unit, spec.meaning))
        start = end
    return table(rows, "field", "positions", "shape", "dtype", "range", "unit", "meaning")


def _shape(spec: FieldSpec) -> str:
    return "-" if spec.kind is FieldKind.TEXT else str(spec.shape)


def role_comparison(specs_of: Callable[[Role, SpaceLimits], tuple[FieldSpec, ...]]) -> list[str]:
    """Returns a table of the fields of all roles, with the shape of each field in the space of each role."""
    spaces = {role: {spec.name: spec for spec in specs_of(role, LIMITS)} for role in AGENT_ROLES}
    names = dict.fromkeys(name for space in spaces.values() for name in space)

    def cell(spec: FieldSpec | None) -> str:
        if spec is None:
            return ""
        return "text" if spec.kind is FieldKind.TEXT else _shape(spec)

    rows = ((f"`{name}`", *(cell(spaces[role].get(name)) for role in AGENT_ROLES)) for name in names)
    return table(rows, "field", *(f"[`{role}`]({role}.md)" for role in AGENT_ROLES))


def pedal_actions() -> list[str]:
    """Returns the tables of both controls."""
    return [*vector_table(CONTROL_SPECS), "", 'With `control="acceleration"`:', "", *vector_table(ACCELERATION_SPECS)]


def navigation_actions() -> list[str]:
    """Returns the table of the actions of `Navigation-v0`."""
    rows = []
    for action in NavigationAction:
        physical = physical_of(action, driver_arrays())
        name, argument = "", ""
        if action.sector is not None:
            name, argument = (
                PhysicalAction.J_TURN.label,
                f"angle of the exit in the sector around {SECTORS[action.sector]} deg",
            )
        elif action is NavigationAction.LIGHTS:
            name, argument = PhysicalAction.LIGHT_CHANGE.label, "on if the headlights are off, else off"
        elif physical is not None:
            name = physical.action.label
            if physical.action is PhysicalAction.LANE_SWITCH:
                argument = f"{physical.angle} deg"
            elif physical.action is PhysicalAction.SPEED_CHANGE:
                argument = "faster" if physical.up else "slower"
        rows.append((str(int(action)), f"`{action.name}`", name, argument))
    return table(rows, "value", "`NavigationAction`", "physical action", "argument")


KINEMATICS: Mapping[str, tuple[str, str]] = {
    "presence": ("1", "1 in used rows"),
    "x": ("200 m", "x of the position"),
    "y": ("4 m per parallel lane", "y of the position"),
    "vx": ("80 m/s", "x of the velocity"),
    "vy": ("80 m/s", "y of the velocity"),
}
"""Unit and meaning of the features of highway-env's `Kinematics` (`KinematicObservation.normalize_obs`)."""

META_ACTIONS: Mapping[str, str] = {
    "LANE_LEFT": "changes to the lane on the left",
    "IDLE": "keeps the lane and the target speed",
    "LANE_RIGHT": "changes to the lane on the right",
    "FASTER": "selects the next higher target speed",
    "SLOWER": "selects the next lower target speed",
}
"""Effect of the actions of highway-env's `DiscreteMetaAction`."""


def kinematics() -> list[str]:
    """Returns the observations of `Town-v0`, with a table of the features."""
    space = _town().observation_space
    features = _town().unwrapped.observation_type.features  # type: ignore[attr-defined]
    low, high = float(space.low.min()), float(space.high.max())  # type: ignore[attr-defined]
    rows = ((str(k), f"`{name}`", *KINEMATICS[name]) for k, name in enumerate(features))
    return [
        f"By default `Box({low:g}, {high:g}, {space.shape}, {space.dtype})`: row 0 is the ego, the other rows are the"
        " nearest objects, nearest first, relative to the ego. Values are normalised by their unit and clipped to"
        " [-1, 1]; unused rows are 0.",
        "",
        *table(rows, "column", "feature", "unit", "meaning"),
    ]


def meta_actions() -> list[str]:
    """Returns the actions of `Town-v0`, with a table of their effects."""
    kind = _town().unwrapped.action_type  # type: ignore[attr-defined]
    assert isinstance(kind, DiscreteMetaAction)
    rows = ((str(value), f"`{name}`", META_ACTIONS[name]) for value, name in kind.actions.items())
    speeds = ", ".join(f"{speed:g}" for speed in kind.target_speeds)
    return [
        f"By default `Discrete({len(kind.actions)})` with the target speeds {speeds} m/s:",
        "",
        *table(rows, "value", "action", "effect"),
    ]


def _town() -> gym.Env[Any, Any]:
    return gym.make("dorothie_gym/Town-v0")


def weight_table(named: Mapping[str, object]) -> list[str]:
    """Returns a table of the terms of a reward, from the docstring of the weights' dataclass.

    Args:
        named: instances of one dataclass by the name of their column.
    """
    first = next(iter(named.values()))
    assert is_dataclass(first)
    meanings = _attributes(type(first))
    rows = (
        (f"`{field.name}`", *(f"{getattr(one, field.name):g}" for one in named.values()), meanings[field.name])
        for field in fields(first)
    )
    return table(rows, "term", *named, "counted")


def _attributes(cls: type) -> dict[str, str]:
    """Returns the description of each attribute in the section "Attributes" of a docstring."""
    section = inspect.getdoc(cls).split("Attributes:\n", 1)[1].split("\n\n", 1)[0]  # type: ignore[union-attr]
    parts = re.split(r"^    (\w+): ", section, flags=re.MULTILINE)[1:]
    return {name: " ".join(text.split()).rstrip(".") for name, text in zip(parts[::2], parts[1::2], strict=True)}
