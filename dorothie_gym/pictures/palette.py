"""Colours of all pictures: a light paper map with slate streets and a few strong accents."""

from __future__ import annotations

from typing import TypeAlias

Colour: TypeAlias = tuple[int, int, int]

# The ground and what is built on it.
COUNTRY: Colour = (231, 235, 221)
BLOCK: Colour = (244, 239, 228)
PARK: Colour = (215, 228, 201)
TREE: Colour = (196, 215, 181)
COUNTRY_TREE: Colour = (217, 226, 206)
SIDEWALK: Colour = (221, 216, 205)
SIDEWALK_EDGE: Colour = (200, 194, 181)
KERB: Colour = (82, 88, 99)
ROAD: Colour = (110, 117, 129)
MEDIAN: Colour = (178, 203, 158)
MEDIAN_TREE: Colour = (152, 184, 132)
MEDIAN_KERB: Colour = (212, 212, 206)
BRIDGE_EDGE: Colour = (52, 58, 69)
BRIDGE_PARAPET: Colour = (226, 224, 217)
BRIDGE_SHADOW: Colour = (184, 185, 176)
TUNNEL: Colour = (203, 204, 203)
TUNNEL_EDGE: Colour = (128, 133, 142)
CUTTING: Colour = (214, 212, 200)
CUTTING_EDGE: Colour = (150, 152, 146)
BAY: Colour = (161, 167, 176)
PIN: Colour = (178, 58, 72)

# Paint on the road.
LANE_LINE: Colour = (240, 241, 242)
EDGE_LINE: Colour = (196, 200, 206)
CENTRE_LINE: Colour = (247, 201, 84)
HATCHING: Colour = (243, 199, 92)
STOP_LINE: Colour = (250, 250, 250)
ZEBRA: Colour = (246, 246, 244)
ARROW: Colour = (243, 244, 245)
ONE_WAY: Colour = (169, 206, 245)

# Lights and signs.
LIGHT_BODY: Colour = (34, 38, 47)
LIGHT_RIM: Colour = (250, 250, 248)
LIGHT_OFF: Colour = (84, 88, 96)
LIGHT_RED: Colour = (235, 72, 62)
LIGHT_AMBER: Colour = (250, 186, 48)
LIGHT_GREEN: Colour = (58, 190, 110)
SIGN_RED: Colour = (205, 42, 48)
SIGN_WHITE: Colour = (252, 252, 250)

# Words.
INK: Colour = (46, 54, 68)
INK_SOFT: Colour = (105, 112, 124)
PAPER: Colour = (255, 255, 255)
SHEET: Colour = (251, 248, 241)
STREET_NAME: Colour = (255, 255, 255)

# Moving objects.
CAR: Colour = (36, 107, 235)
CAR_GLASS: Colour = (205, 224, 255)
TRAIL: Colour = (132, 180, 255)
WAYPOINT: Colour = (226, 196, 255)
VEHICLE: Colour = (66, 73, 86)
CYCLIST: Colour = (18, 150, 150)
PEDESTRIAN: Colour = (214, 92, 140)
PROP: Colour = (230, 126, 34)
HEADLIGHT: Colour = (255, 226, 130)
DIRECTION: Colour = (22, 70, 160)
EXCEPTION: Colour = (160, 60, 150)

# Goals, by their state.
STATE: dict[str, Colour] = {
    "none": (128, 136, 150),
    "pending": (232, 157, 36),
    "ongoing": (36, 107, 235),
    "complete": (34, 160, 94),
    "abandoned": (196, 82, 82),
}

STATE_INK: dict[str, Colour] = {
    "none": (98, 106, 120),
    "pending": (150, 92, 6),
    "ongoing": (30, 98, 222),
    "complete": (20, 122, 70),
    "abandoned": (176, 64, 64),
}
"""Colours of words about goals: darker, with a contrast of at least 4.5 to paper (WCAG 2.1, 1.4.3)."""

# The panel beside the picture.
PANEL: Colour = (249, 249, 247)
PANEL_EDGE: Colour = (222, 224, 228)
BUBBLE_PARTICIPANT: Colour = (255, 240, 214)
BUBBLE_CO_WIZARD: Colour = (221, 233, 255)
BUBBLE_AD_WIZARD: Colour = (252, 226, 226)
INK_PARTICIPANT: Colour = (140, 84, 10)
INK_CO_WIZARD: Colour = (26, 78, 176)
SUBTITLE_GROUND: Colour = (24, 28, 36)
SUBTITLE_PARTICIPANT: Colour = (255, 200, 112)
SUBTITLE_CO_WIZARD: Colour = (142, 190, 255)
SUBTITLE_AD_WIZARD: Colour = (240, 158, 226)
SUBTITLE_CAR: Colour = (214, 218, 224)
NOTE: Colour = (190, 62, 62)
