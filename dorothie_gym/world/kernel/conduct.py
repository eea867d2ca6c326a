"""How people drive, in numbers: gaps, braking, patience at junctions."""

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
