"""User data (`userData`) that our OpenDRIVE files have beyond the standard; other readers ignore it."""

VENDOR = "dorothie_gym"
"""Vendor in the header of our files: names of roads are those of streets, whatever they look like."""

LANE_BEGINS = "dorothie_gym:lane"
"""Code of a lane of a lane section that is no part of the lane before it."""

TURN = "dorothie_gym:turn"
"""Code of a lane across a junction; `value` is the type of the turn over it, which angles do not always give."""

PROGRAMME = "dorothie_gym:programme"
"""Code of the programme of the lights of a junction; `value` is its offset [s], children are its phases."""
