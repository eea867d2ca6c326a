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


# --- How people drive, in numbers: gaps, braking, patience at junctions ----------------------------------------------

# --- at junctions ----------------------------------------------------------------------------------------------------

COMFORTABLE_BRAKING = 3.0
"""Who can stop before a yellow light no harder than this does so (ITE's 10 ft/s^2 for yellow times) [m/s^2]."""

HARDEST_BRAKING = 6.0
"""Who cannot stop before a red light with this any more goes on [m/s^2]."""

CRITICAL_GAP = 4.5
"""Who gives way goes if nobody with priority comes sooner (Highway Capacity Manual 2010, permitted left turns) [s]."""

GIVING_WAY_PATIENCE = 30.0
"""Who has been giving way for longer than this has its turn like anybody else [s]."""

SNEAKING = 2.0
"""Who has been giving way at a green light for this long may go when it turns yellow (HCM's sneakers) [s]."""

START = 0.3
"""Who uses the yellow takes this long to start, and then as long as it takes to reach the line [s]."""

AT_LINE = 3.5
"""Who stands with its front this close before the line stands at it [m]."""

OVER_LINE = 0.5
"""Who is this far over the line does not stop for its light any more [m]."""

STANDING = 0.3
"""Slower than this a vehicle stands [m/s]."""

UNUSED = 3.0
"""Who was let in and stands before the junction for this long has to ask again [s]."""

LAPSE = 1.0
"""Who was let in, or waits, and asks no more (it goes elsewhere) has lost its place after this long [s]."""

# --- on the road ------------------------------------------------------------------------------------------------------

CURVE_ACCELERATION = 2.5
"""Lateral acceleration in curves [m/s^2]."""

CURVE_BRAKING = 2.0
"""Deceleration towards a curve [m/s^2]."""

STOP_BRAKING = 3.0
"""Deceleration towards a junction [m/s^2]."""

ASKING = 9.5
"""A vehicle asks for a junction this far before it would have to brake for it [m]."""

LINE_GAP = 1.0
"""Room that is left before a line [m]."""

ROOM_BEHIND = 10.5
"""Free lane that a vehicle wants behind a junction before it enters: its length, the distance that it keeps when it
stands, and what it takes to have left the junction [m]."""

ROOM_SIGHT = 60.0
"""How far from the start of the lane behind a junction others count who may come to a stand on it [m]."""

ROOM_EACH = 10.0
"""Lane that a vehicle takes up in a queue: its length and the distance that stock's IDM keeps [m]."""

SLOW = 4.0
"""Slower than this a vehicle behind a junction may be in the way: a car that turns round does 3.5 [m/s]."""

CROSSING_SIGHT = 40.0
"""How far a car is seen that turns round [m]."""

CROSSING_MARGIN = 0.5
"""Room that is left beside it [m]."""
