from __future__ import annotations

import copy

import numpy as np
import pytest

from dorothie_gym.ontology import NAVIGATION_ACTIONS, ExceptionKind, PhysicalAction, PropKind, Role
from dorothie_gym.session.observations import ActionMasks
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.spaces import SpaceLimits, action_space
from dorothie_gym.session.view_arrays import RoleArrays
from dorothie_gym.session.view_steps import SessionViews
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.world import World
from dorothie_gym.tasks import TaskState
from tests.sim.driving import network, world_at


def in_town(name: str) -> tuple[World, ActionMasks, SpaceLimits]:
    town = network(name).town
    scenario = draw_scenario(town, None, 4)
    world = world_at(name, *scenario.departure, WorldConfig(vehicles=4, pedestrians=0))
    limits = SpaceLimits()
    views = SessionViews(world, RoleArrays(limits, observe_acts=True), 0)
    return world, ActionMasks(views, TaskState(scenario.storyboard)), limits


def fitting_angles(world: World, action: PhysicalAction, angles: list[int]) -> list[int]:
    if action is PhysicalAction.J_TURN:
        return [way.angle for way in world.planner.exits()[0] if way.angle in angles]
    if action is PhysicalAction.LANE_SWITCH:
        exits = {way.angle for way in world.planner.exits()[0]}
        return [angle for angle in (90, -90) if angle in angles and angle not in exits]
    return [0]


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_each_allowed_physical_action_is_accepted(name: str) -> None:
    world, masks, _ = in_town(name)
    rng, tried = np.random.default_rng(2), dict.fromkeys(NAVIGATION_ACTIONS, 0)
    for _ in range(240):
        mask = masks.mask(Role.CO_WIZARD)
        angles = [int(k) - 180 for k in np.flatnonzero(mask["angle"])]
        allowed = [action for action in NAVIGATION_ACTIONS if mask["physical"][action]]
        speed = float(world.car.speed)
        for action in allowed:
            for angle in fitting_angles(world, action, angles):
                planner = copy.deepcopy(world).planner
                assert planner.command(action, angle, speed) is None, (action, angle)
                tried[action] += 1
        for action in set(NAVIGATION_ACTIONS) - set(allowed) - {PhysicalAction.LANE_FOLLOW, PhysicalAction.J_TURN}:
            assert copy.deepcopy(world).planner.command(action, 90, speed) is not None or action is PhysicalAction.STOP
        choice = allowed[int(rng.integers(len(allowed)))]
        fitting = fitting_angles(world, choice, angles)
        if fitting and rng.random() < 0.4:
            world.planner.command(choice, fitting[int(rng.integers(len(fitting)))], speed)
        world.step(15)
    assert all(count > 0 for action, count in tried.items() if action is not PhysicalAction.LANE_SWITCH), tried
    assert name == "brookside" or tried[PhysicalAction.LANE_SWITCH] > 0


@pytest.mark.parametrize("role", [Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD])
def test_masks_fit_the_spaces(role: Role) -> None:
    world, masks, limits = in_town("brookside")
    space = action_space(role, limits)
    assert set(masks.mask(role)) == set(space.spaces)
    sample = space.sample(mask=masks.mask(role))
    assert space.contains(sample)
    if role is not Role.PARTICIPANT:
        assert sample["lane"] < len(world.town.lanes)


def test_returned_masks_may_be_changed() -> None:
    _, masks, _ = in_town("brookside")
    for value in masks.mask(Role.AD_WIZARD).values():
        if isinstance(value, np.ndarray):
            value[:] = 0
    assert masks.mask(Role.AD_WIZARD)["lane"].any()


def test_exception_mask_follows_props_and_task() -> None:
    world, masks, limits = in_town("brookside")
    mask = masks.mask(Role.AD_WIZARD)["exception"]
    assert not mask[ExceptionKind.MOVE_PROP]
    assert not mask[ExceptionKind.DELETE_PROP]
    for _ in range(limits.props):
        world.actors.add_prop(PropKind.TREE, 0, 40.0)
    mask = masks.mask(Role.AD_WIZARD)["exception"]
    assert mask[ExceptionKind.MOVE_PROP]
    assert not mask[ExceptionKind.PLACE_PROP]
