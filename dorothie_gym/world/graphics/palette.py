"""Colours of every picture, in one place: a calm paper map with a few loud things on it."""

from __future__ import annotations

from typing import TypeAlias

Colour: TypeAlias = tuple[int, int, int]

# The ground and what is built on it.
COUNTRY: Colour = (226, 233, 218)
BLOCK: Colour = (241, 239, 232)
PARK: Colour = (208, 227, 196)
TREE: Colour = (185, 211, 170)
COUNTRY_TREE: Colour = (207, 220, 196)
SIDEWALK: Colour = (225, 225, 221)
KERB: Colour = (192, 197, 204)
ROAD: Colour = (255, 255, 255)
BRIDGE_EDGE: Colour = (148, 156, 168)
BRIDGE_SHADOW: Colour = (205, 208, 208)
PLOT: Colour = (233, 221, 196)
PLOT_EDGE: Colour = (208, 188, 150)

# Paint on the road.
LANE_LINE: Colour = (196, 202, 211)
CENTRE_LINE: Colour = (240, 197, 92)
STOP_LINE: Colour = (150, 158, 170)
ZEBRA: Colour = (200, 205, 213)
ARROW: Colour = (160, 170, 185)

# Signals.
LIGHT_BODY: Colour = (58, 64, 76)
LIGHT_RED: Colour = (226, 84, 76)
LIGHT_AMBER: Colour = (240, 180, 60)
LIGHT_GREEN: Colour = (72, 176, 112)

# Words.
INK: Colour = (52, 60, 74)
INK_SOFT: Colour = (116, 124, 138)
PAPER: Colour = (255, 255, 255)

# Who and what moves.
CAR: Colour = (36, 107, 235)
CAR_GLASS: Colour = (205, 224, 255)
TRAIL: Colour = (116, 166, 250)
WAYPOINT: Colour = (146, 84, 222)
VEHICLE: Colour = (122, 131, 145)
CYCLIST: Colour = (18, 150, 150)
PEDESTRIAN: Colour = (214, 92, 140)
PROP: Colour = (230, 126, 34)
HEADLIGHT: Colour = (255, 226, 130)

# Goals, by their state.
STATE: dict[str, Colour] = {
    "none": (128, 136, 150),
    "pending": (232, 157, 36),
    "ongoing": (36, 107, 235),
    "complete": (34, 160, 94),
    "abandoned": (196, 82, 82),
}

# The panel beside the picture.
PANEL: Colour = (249, 249, 247)
PANEL_EDGE: Colour = (222, 224, 228)
BUBBLE_PARTICIPANT: Colour = (255, 240, 214)
BUBBLE_CO_WIZARD: Colour = (221, 233, 255)
BUBBLE_AD_WIZARD: Colour = (252, 226, 226)
NOTE: Colour = (190, 62, 62)
