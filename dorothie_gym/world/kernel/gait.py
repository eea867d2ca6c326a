"""How people walk beside streets and cross them, in numbers."""

WALKING_SPEED = 1.3
"""[m/s], the usual design value for pedestrians (MUTCD takes 1.1)."""

KERB = 1.6
"""Distance from the lane's edge at which they walk [m]."""

FROM_ENDS = 4.0
"""How far from the ends of a lane they turn back [m]."""

FROM_JUNCTION = 12.0
"""How far from the ends of a lane they cross, so that they do not walk into a junction [m]."""

WALK_STEP = 2.0
"""Step in which a walkway is looked for [m]."""

SHORTEST_WALK = 8.0
"""Shortest walkway [m]."""

CROSSING_RATE = 1 / 45
"""How often a pedestrian wants to cross [1/s]."""

PERSONAL_SPACE = 0.7
"""How close to a vehicle they step [m]."""

PATIENCE = 2.0
"""How long they stand before a vehicle, a prop or somebody else that does not move before they turn back [s]."""

ELBOW_ROOM = 0.3
"""How close to a prop or to somebody else they step [m]."""

SAFE_TIME = 5.0
"""Time gap to vehicles that they want before stepping out [s]."""

SAFE_DISTANCE = 14.0
"""And distance [m]."""
