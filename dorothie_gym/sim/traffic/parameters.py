"""Parameters of the traffic: highway-env's own, read off its classes, cyclists, junctions, respawning."""

from __future__ import annotations

import math

from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

from dorothie_gym.support import portable_math as pm

# --- highway-env's Intelligent Driver Model, lane changes and controllers -------------------------------------------

ACC_MAX = float(IDMVehicle.ACC_MAX)
"""Greatest acceleration and deceleration [m/s^2]."""

COMFORT = float(IDMVehicle.COMFORT_ACC_MAX)
"""Desired acceleration [m/s^2]."""

CLOSING = 2.0 * math.sqrt(-IDMVehicle.COMFORT_ACC_MAX * IDMVehicle.COMFORT_ACC_MIN)
"""Twice the root of the product of desired acceleration and deceleration [m/s^2]."""

STANDING_GAP = float(IDMVehicle.DISTANCE_WANTED - IDMVehicle.LENGTH)
"""Gap between two stationary vehicles [m]; highway-env counts it from centre to centre of vehicles of 5 m."""

TIME_WANTED = float(IDMVehicle.TIME_WANTED)
"""Desired time gap [s]."""

if IDMVehicle.DELTA != 4.0:  # the kernel writes the power as products
    raise ImportError(f"the kernel is written for highway-env's exponent 4 of IDM, not {IDMVehicle.DELTA}")

LANE_CHANGE_GAIN = float(IDMVehicle.LANE_CHANGE_MIN_ACC_GAIN)
"""Gain of acceleration that a lane change must bring [m/s^2]."""

LANE_CHANGE_BRAKING = float(IDMVehicle.LANE_CHANGE_MAX_BRAKING_IMPOSED)
"""Braking that a lane change may impose [m/s^2]."""

LANE_CHANGE_DELAY = float(IDMVehicle.LANE_CHANGE_DELAY)
"""Time between two considerations of a lane change [s]."""

KP_LATERAL = float(IDMVehicle.KP_LATERAL)
"""Gain from the lateral distance to the lateral speed [1/s]."""

KP_HEADING = float(IDMVehicle.KP_HEADING)
"""Gain from the error of heading to the rate of turning [1/s]."""

TAU_PURSUIT = float(IDMVehicle.TAU_PURSUIT)
"""Look-ahead time for the lane's heading [s]."""

LARGEST_HEADING = math.pi / 4
"""Largest angle to the lane that is steered for [rad], `ControlledVehicle.steering_control`."""

MAX_SLIP_SINE = pm.sin(pm.atan(0.5 * pm.tan(float(IDMVehicle.MAX_STEERING_ANGLE))))
"""Sine of the slip angle at full lock of the steering wheel."""

MAX_SPEED = float(Vehicle.MAX_SPEED)
"""[m/s]."""

CAR_LENGTH, CAR_WIDTH = float(Vehicle.LENGTH), float(Vehicle.WIDTH)
"""Size of a car [m]."""

AFTER_END = CAR_LENGTH / 2
"""Distance before the end of a lane at which the next one begins to be followed [m], `AbstractLane.after_end`."""

# --- Sizes of arrays, lanes -------------------------------------------------------------------------------------------

PLANNED = 24
"""Maximum number of lanes that a vehicle plans ahead, its own one included."""

GOALS = 16
"""Maximum number of goals on the ego's path."""

CLOSED = 4
"""Maximum number of junctions that one U-turn reaches into."""

POINTS = 208
"""Maximum number of points of the ego's path in the arrays: 1 m apart, half a metre in U-turns."""

COURSE, STEPS = 320, 128
"""Points of the ego's whole path and lanes of a plan for which there is room at first."""

EVENTS = 32
"""Maximum number of events of the ego within a call."""

MAX_SUBSTEPS = 15
"""Maximum number of substeps within a call of a world with a driven ego, whose path is lengthened in between."""

STOPPED = 0.05
"""Speed below which a braking vehicle comes to a standstill [m/s]."""

CHANGE_TIME = 3.0
"""Duration of a lane change [s]; none begins where the lane ends sooner."""

VEHICLE_SPEEDS = 6.5, 10.0
"""Range of the desired speeds of cars [m/s], in towns with slow traffic; elsewhere they are shares of the limit."""


# --- Cyclists ---------------------------------------------------------------------------------------------------------

CYCLIST_LENGTH, CYCLIST_WIDTH = 1.8, 0.7
"""Size of a bicycle with its rider [m] (AASHTO, Guide for the Development of Bicycle Facilities, 2012: 70 x 30 in)."""

CYCLIST_SPEEDS = 15.0 / 3.6, 20.0 / 3.6
"""Slowest and fastest cyclist [m/s]: the middle of speeds measured in towns (Dozza & Werneke 2014: 14 to 20 km/h)."""

CYCLIST_ACCELERATION = 1.0
"""Greatest acceleration of a cyclist [m/s^2]."""

CYCLIST_SHARE = 1 / 8
"""Share of cyclists among the vehicles of a town."""

CYCLIST_ROADS = 60.5 / 3.6
"""Highest speed limit of lanes with cyclists [m/s]."""

CYCLIST_BEFORE, CYCLIST_BEHIND = 6.0, 15.0
"""Gaps ahead and behind on the lane towards the kerb with which a cyclist moves over to it [m]."""

CYCLIST_FROM_EDGE = 0.9
"""Distance of a cyclist from the edge of the lane at the kerb [m]."""

# --- Respawning -------------------------------------------------------------------------------------------------------

TOW_CRASHED = 3.0
"""Time after which a crashed vehicle is respawned [s]."""

TOW_BLOCKED = 15.0
"""Time after which a vehicle that waits before a prop is respawned [s]."""

TOW_FACING = 6.0
"""Time after which a vehicle is respawned that waits before the ego while the ego stands in a U-turn [s]."""

TOW_STUCK = 60.0
"""Time after which any vehicle that stands for another reason than a red light is respawned, against gridlocks [s]."""

GOES_HOME = 45.0
"""Time without progress after which a pedestrian is respawned [s]; longer than the wait at a crosswalk."""

CLEAR_OF_CAR = 25.0
"""Minimum distance to the ego at which vehicles are added to a town [m]."""

CLEAR_OF_WALKER = 8.0
"""Minimum distance to the ego at which pedestrians are added [m]; `CLEAR_OF_PEOPLE` is that between pedestrians."""

CLEAR_OF_PEOPLE = 1.5
"""Minimum distance between pedestrians that are added [m]."""

OUT_OF_SIGHT = 60.0
"""Minimum distance to the ego at which bodies respawn [m]."""

CLEAR_OF_OTHERS, CLEAR_BESIDE = 14.0, 2.5
"""Minimum distance ahead and behind to others, no farther aside than `CLEAR_BESIDE`, for new vehicles [m]."""

CLEAR_OF_BODIES = 6.0
"""Minimum distance to the centre of others at which vehicles appear, half of it aside [m]."""


# --- Junctions --------------------------------------------------------------------------------------------------------

HARDEST_BRAKING = 6.0
"""Deceleration beyond which a vehicle no longer stops before a red light [m/s^2]."""

CRITICAL_GAP = 4.5
"""Minimum time gap to vehicles with priority [s] (Highway Capacity Manual 2010, permitted left turns)."""

GIVING_WAY_PATIENCE = 30.0
"""Longest time an actor yields before it competes by arrival order [s]."""

SNEAKING = 2.0
"""Time of yielding at a green light after which a vehicle may use the yellow phase [s] (HCM's sneakers)."""

START = 0.3
"""Time to start for a vehicle that uses the yellow phase, without the distance to the line [s]."""

AT_LINE = 3.5
"""Distance of the front to the line within which a vehicle counts as standing at it [m]."""

OVER_LINE = 0.5
"""Distance past the line at which a vehicle no longer stops for its light [m]."""

TRAFFIC_STANDING = 0.3
"""Speed below which a vehicle of the traffic counts as standing [m/s]."""

UNUSED = 3.0
"""Stand before the junction after which a permission lapses [s]."""

LAPSE = 1.0
"""Time without a request after which a permission or a place in the order of arrival lapses [s]."""

# --- Driving ----------------------------------------------------------------------------------------------------------

CURVE_ACCELERATION = 2.5
"""Lateral acceleration in curves [m/s^2]."""

CURVE_BRAKING = 2.0
"""Deceleration towards a curve [m/s^2]."""

STOP_BRAKING = 3.0
"""Deceleration towards a junction [m/s^2]."""

ASKING = 9.5
"""Distance before the beginning of braking at which a vehicle requests a junction [m]."""

LINE_GAP = 1.0
"""Room left before a line [m]."""

ROOM_BEHIND = 10.5
"""Free lane that a vehicle wants beyond a junction before it enters: its length, the distance that it keeps when it
stands, and the length needed to clear the junction [m]."""

ROOM_SIGHT = 60.0
"""Distance beyond a junction within which slow vehicles count against its room [m]."""

ROOM_EACH = 10.0
"""Lane that a vehicle takes up in a queue: its length and the distance that highway-env's IDM keeps [m]."""

SLOW = 4.0
"""Speed below which a vehicle beyond a junction may obstruct it [m/s]; in a U-turn the ego drives at 3.5 m/s."""

CROSSING_SIGHT = 40.0
"""Distance within which traffic yields to a U-turn of the ego [m]."""

CROSSING_MARGIN = 0.5
"""Room left beside that U-turn [m]."""

STEP_AHEAD = 5.0
"""Distance of a coming pedestrian to the centre of a lane within which vehicles stop before the crosswalk [m]."""

STEP_PAST = 2.5
"""Distance of a pedestrian past the centre of a lane within which vehicles still stop [m]."""
