"""How fast the car goes and how it brakes: limits that its driver and the compiled world share."""

KMH = 1 / 3.6
"""[m/s] of one km/h."""

LATERAL_ACCELERATION = 2.2
"""Comfortable in curves [m/s^2]."""

PROFILE_BRAKING = 2.0
"""Deceleration towards a curve or the end of the path [m/s^2]."""

SURE_BRAKING = 1.8
"""From this on, braking that is needed is applied whatever the speed controller says [m/s^2]."""

APPROACH_SPEED = 14.0 * KMH
"""Speed near a goal, under the design's 15 km/h [m/s]."""

APPROACH_DISTANCE = 20.0
"""Where a goal begins to be near [m]."""

PROP_DEPTH = 1.25
"""Half the length of the longest prop: it is in sight when its middle is [m]."""

WALKING_SPEED = 1.5
"""Speed of a car that hardly sees anything [m/s]."""
