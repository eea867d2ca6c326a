"""Numbers that the compiled loops use: highway-env's own, read off its classes, and those of the town's traffic."""

from __future__ import annotations

import math

from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

# --- highway-env's Intelligent Driver Model, lane changes and controllers -------------------------------------------

ACC_MAX = float(IDMVehicle.ACC_MAX)
"""Greatest acceleration and deceleration [m/s^2]."""

COMFORT = float(IDMVehicle.COMFORT_ACC_MAX)
"""Acceleration that is wanted [m/s^2]."""

CLOSING = 2.0 * math.sqrt(-IDMVehicle.COMFORT_ACC_MAX * IDMVehicle.COMFORT_ACC_MIN)
"""Twice the root of wanted acceleration and wanted deceleration [m/s^2]."""

STANDING_GAP = float(IDMVehicle.DISTANCE_WANTED - IDMVehicle.LENGTH)
"""Room between two vehicles that stand [m]; stock counts it from middle to middle of vehicles of 5 m."""

TIME_WANTED = float(IDMVehicle.TIME_WANTED)
"""Time gap that is wanted [s]."""

if IDMVehicle.DELTA != 4.0:  # the kernel writes the power as products
    raise ImportError(f"the kernel is written for highway-env's exponent 4 of IDM, not {IDMVehicle.DELTA}")

LANE_CHANGE_GAIN = float(IDMVehicle.LANE_CHANGE_MIN_ACC_GAIN)
"""Gain of acceleration that a lane change must bring [m/s^2]."""

LANE_CHANGE_BRAKING = float(IDMVehicle.LANE_CHANGE_MAX_BRAKING_IMPOSED)
"""Braking that a lane change may impose [m/s^2]."""

LANE_CHANGE_DELAY = float(IDMVehicle.LANE_CHANGE_DELAY)
"""Time between two thoughts of changing lanes [s]."""

KP_LATERAL = float(IDMVehicle.KP_LATERAL)
"""Gain from the lateral distance to the lateral speed [1/s]."""

KP_HEADING = float(IDMVehicle.KP_HEADING)
"""Gain from the error of heading to the rate of turning [1/s]."""

TAU_PURSUIT = float(IDMVehicle.TAU_PURSUIT)
"""How far ahead the lane's heading is taken [s]."""

LARGEST_HEADING = math.pi / 4
"""Largest angle to the lane that is steered for [rad], `ControlledVehicle.steering_control`."""

MAX_SLIP = math.sin(math.atan(0.5 * math.tan(float(IDMVehicle.MAX_STEERING_ANGLE))))
"""Sine of the slip angle at full lock of the steering wheel."""

MAX_SPEED = float(Vehicle.MAX_SPEED)
"""[m/s]."""

CAR_LENGTH, CAR_WIDTH = float(Vehicle.LENGTH), float(Vehicle.WIDTH)
"""Size of a car [m]."""

AFTER_END = CAR_LENGTH / 2
"""This far before the end of a lane [m] the next one is followed, `AbstractLane.after_end`."""

# --- lanes ----------------------------------------------------------------------------------------------------------

PLANNED = 24
"""Most lanes that a vehicle plans ahead, its own one included."""

GOALS = 16
"""Most places on the car's path that it comes up to slowly."""

CLOSED = 4
"""Most junctions that a car turns round in at once."""

POINTS = 208
"""Most points of the car's path that the loops look at: 1 m apart, half a metre in U-turns."""

EVENTS = 32
"""Most things that happen to the car within a call."""

FRAMES = 15
"""Most substeps within a call of a world with a driven car: its path is lengthened in between."""

STOPPED = 0.05
"""Who brakes at less than this stands [m/s]."""

STUCK_SPEED = 0.3
"""Slower than this a vehicle counts as standing [m/s]."""

CHANGE_TIME = 3.0
"""A lane change takes about this long; where less is left before the lane ends none is begun [s]."""

# --- cyclists -------------------------------------------------------------------------------------------------------

CYCLIST_LENGTH, CYCLIST_WIDTH = 1.8, 0.7
"""Size of a bicycle with its rider [m] (AASHTO, Guide for the Development of Bicycle Facilities, 2012: 70 x 30 in)."""

CYCLIST_SPEEDS = 15.0 / 3.6, 20.0 / 3.6
"""Slowest and fastest cyclist [m/s]: the middle of what is measured in towns (Dozza & Werneke 2014: 14 to 20 km/h)."""

CYCLIST_ACCELERATION = 1.0
"""Greatest acceleration of a cyclist [m/s^2]."""

CYCLIST_SHARE = 1 / 8
"""Share of cyclists among the vehicles of a town."""

CYCLIST_ROADS = 60.5 / 3.6
"""Where more is allowed than this, nobody rides a bicycle [m/s]."""

CYCLIST_BEFORE, CYCLIST_BEHIND = 6.0, 15.0
"""Gaps to those before and behind on the lane to the right [m] for which a cyclist moves over to it."""

CYCLIST_FROM_EDGE = 0.9
"""Distance of a cyclist from the right edge of the lane [m]."""

# --- towing ---------------------------------------------------------------------------------------------------------

TOW_CRASHED = 3.0
"""A crashed vehicle is towed away after this long [s]."""

TOW_BLOCKED = 15.0
"""A vehicle that stands before a prop gives up after this long [s]."""

TOW_FACING = 6.0
"""A vehicle that stands before a car that stands in the middle of a U-turn gives way to it after this long [s]."""

TOW_STUCK = 60.0
"""Any vehicle that stands for this long, not for a red light, is towed away: no knot lasts for ever [s]."""

GOES_HOME = 45.0
"""A pedestrian who has not got on for this long goes home [s]; longer than one waits at a crosswalk."""

CLEAR_OF_CAR = 25.0
"""Nobody is brought to a town closer to the car than this [m]."""

CLEAR_OF_WALKER = 8.0
"""No pedestrian is brought closer to the car than this [m], nor than `CLEAR_OF_PEOPLE` to another one."""

CLEAR_OF_PEOPLE = 1.5
"""See there [m]."""

OUT_OF_SIGHT = 60.0
"""Who comes back elsewhere does so no closer to the car than this [m]."""

CLEAR_OF_OTHERS, CLEAR_BESIDE = 14.0, 2.5
"""Nobody appears closer to others before or behind it than this [m] who are no farther aside than that [m], ..."""

CLEAR_OF_BODIES = 6.0
"""... nor this close to the middle of any, half of it aside [m]."""
