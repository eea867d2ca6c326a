from __future__ import annotations

import itertools
import math

import pytest

from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.ego.ego_controller import GoalAhead
from dorothie_gym.sim.ego.limits import KMH, MAX_CRUISE, MIN_CRUISE
from tests.sim.driving import drive, long_lane, network, on_lane


def test_cruise_speed_changes_in_steps_of_five_within_its_range() -> None:
    roads = network("brookside")
    ego = on_lane(roads, long_lane(roads.town), 2.0).ego
    seen = [ego.cruise]
    while ego.change_cruise(up=True) is None:
        seen.append(ego.cruise)
    assert seen[-1] == MAX_CRUISE
    assert all(b - a == 5.0 for a, b in itertools.pairwise(seen))
    while ego.change_cruise(up=False) is None:
        pass
    assert ego.cruise == MIN_CRUISE


def test_car_drives_at_its_cruise_speed() -> None:
    roads = network("brookside")
    world = on_lane(roads, long_lane(roads.town), 2.0)
    car, ego = world.car, world.ego
    ego.cruise = 20.0
    drive(world, lambda: False, 8.0)
    assert float(car.speed) == pytest.approx(20.0 * KMH, abs=0.4)


@pytest.mark.parametrize("cruise", [40.0, 90.0])
def test_car_approaches_a_goal_slowly_and_stops_within_two_metres(cruise: float) -> None:
    roads = network("brookside")
    lane = long_lane(roads.town)
    world = on_lane(roads, lane, 2.0)
    car, ego = world.car, world.ego
    ego.cruise = cruise
    ego.set_goals([GoalAhead(lane=lane, station=80.0)])
    drive(world, lambda: ego.planner.station > 80.0 - 15.0)
    assert car.speed <= 16.0 * KMH
    # twice a second it is decided whether to stop now
    while True:
        speed = float(car.speed)
        if 80.0 - ego.planner.station < speed**2 / 6.0 + 0.56 * speed + 0.5 * speed / 2:
            ego.planner.command(PhysicalAction.STOP, 0, speed)
            break
        drive(world, lambda: False, 0.5)
    drive(world, lambda: car.speed == 0.0, 8.0)
    assert abs(ego.planner.station - 80.0) < 2.0


def test_controls_are_normalised_and_the_car_never_rolls_back() -> None:
    roads = network("Town02")
    world = on_lane(roads, long_lane(roads.town, 60.0), 2.0)
    car, ego = world.car, world.ego
    ego.planner.command(PhysicalAction.J_TURN, 90, 0.0)

    def check() -> bool:
        control = car.control
        assert 0.0 <= control.throttle <= 1.0
        assert 0.0 <= control.brake <= 1.0
        assert -1.0 <= control.steer <= 1.0
        assert control.throttle == 0.0 or control.brake == 0.0
        assert car.speed >= 0.0
        yaw = math.sin(math.atan(math.tan(control.steering_angle) / 2)) * 2 / car.LENGTH  # per metre
        assert abs(yaw) * float(car.speed) ** 2 < 4.5  # [m/s^2] to the side
        return False

    drive(world, check, 30.0)
