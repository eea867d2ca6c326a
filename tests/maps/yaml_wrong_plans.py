"""Mistakes in plans that need no geometry: junctions, courses, lanes, lights and signs."""

FORD = "Ford Lane: [cross, gate]"
PHASE_1, PHASE_2 = "{green: [Grand Avenue], seconds: 25}", "{left: [Grand Avenue], seconds: 8}"

WRONG = {
    # Junctions and roundabouts
    "same place twice": (
        "[200, 0]",
        "[0, 0]",
        5,
        "junction 'market'|same place as 'cross' (line 4); move or remove one",
    ),
    "roundabout too small": (
        "roundabout: 30",
        "roundabout: 3",
        9,
        "junction 'circus', roundabout|from 8 to 150, not '3'",
    ),
    "roundabout too wide": ("lanes: 1", "lanes: 4", 9, "junction 'circus', lanes|from 1 to 3, not '4'"),
    "lanes of a plain junction": (
        "roundabout: 30, lanes",
        "lanes",
        9,
        "junction 'circus': 'lanes' is for roundabouts; remove it, or add 'roundabout: 30'",
    ),
    "street named as the ring": ("King Street:", "circus:", 13, "street 'circus'|give this one another"),
    # Courses
    "unknown junction": (
        FORD,
        "Ford Lane: [cross, gaet]",
        12,
        "street 'Ford Lane': unknown junction 'gaet'; known are cross, market|did you mean 'gate'?",
    ),
    "junction with a capital": (FORD, "Ford Lane: [Cross, gate]", 12, "unknown junction 'Cross'|did you mean 'cross'?"),
    "course in words": (
        FORD,
        "Ford Lane: cross",
        12,
        "a list of junctions and points that it runs through, not 'cross'",
    ),
    "course of one": (FORD, "Ford Lane: [cross]", 12, "'Ford Lane': it runs nowhere; name at least the two junctions"),
    "step twice": (FORD, "Ford Lane: [cross, cross, gate]", 12, "'cross' comes twice in a row; remove one"),
    "point twice": (FORD, "Ford Lane: [cross, [0, 90], [0, 90], gate]", 12, "[0, 90] comes twice in a row; remove one"),
    "starts at a point": (
        FORD,
        "Ford Lane: [[0, 50], gate]",
        12,
        "it starts at [0, 50], which is no junction: dead ends are not supported; name a",
    ),
    "ends at a point": (FORD, "Ford Lane: [cross, [0, 90]]", 12, "it ends at [0, 90], which is no junction"),
    # Directions, medians, turn lanes, ramps
    "one-way and back": (
        "one_way: true",
        "one_way: true, lanes: [2, 1]",
        13,
        "'King Street', lanes: a one-way street has no lanes backward; write one number, or remove the key 'one_way'",
    ),
    "ramp and back": (
        "one_way: true",
        "ramp: true, lanes: [1, 1]",
        13,
        "a ramp has no lanes backward|remove the key 'ramp'",
    ),
    "ramp both ways": (
        "one_way: true",
        "ramp: true, one_way: false",
        13,
        "'King Street', one_way: a ramp has one direction; remove this key",
    ),
    "median of a one-way street": (
        "one_way: true",
        "one_way: true, median: 4",
        13,
        "'King Street', median: a median keeps two directions apart and this street has one; remove it",
    ),
    "turn lanes of a one-way street": (
        "one_way: true",
        "one_way: true, turn_lanes: [corner]",
        13,
        "'King Street', turn_lanes: a one-way street has no median for turn lanes; remove them",
    ),
    "median too narrow": (
        "median: 4",
        "median: 2",
        11,
        "turn_lanes: turn lanes lie in the median, which is 2 m wide and the lanes are 3.5 m; write 'median: 3.5'",
    ),
    "no median": ("median: 4, ", "", 11, "turn_lanes: turn lanes lie in the median, which is 0 m wide|'median: 3.5'"),
    "turn lane elsewhere": (
        "turn_lanes: [market]",
        "turn_lanes: [gate]",
        11,
        "does not run through 'gate'; it does through cross, market, circus",
    ),
    "turn lane nowhere": (
        "turn_lanes: [market]",
        "turn_lanes: [markt]",
        11,
        "unknown junction 'markt'|did you mean 'market'?",
    ),
    "turn lane twice": (
        "turn_lanes: [market]",
        "turn_lanes: [market, market]",
        11,
        "'market' is there twice; remove one",
    ),
    "turn lane at a roundabout": (
        "turn_lanes: [market]",
        "turn_lanes: [circus]",
        11,
        "'circus' is a roundabout, which has no left turns; remove it",
    ),
    "turn lane not in a list": (
        "turn_lanes: [market]",
        "turn_lanes: market",
        11,
        "a list of junctions, not 'market'; put it into brackets: [market]",
    ),
    # Lights
    "lights at nothing": ("- cross", "- crss", 19, "lights: unknown junction 'crss'|did you mean 'cross'?"),
    "lights twice": ("- cross", "- market", 20, "lights: 'market' is there twice (first in line 19); remove one"),
    "lights at a roundabout": (
        "- cross",
        "- circus",
        19,
        "lights: 'circus' is a roundabout, which has no lights but yield signs; remove it here",
    ),
    "offset below nothing": (
        "offset: 10",
        "offset: -10",
        21,
        "lights, offset: this must be a number of seconds from 0 to 600, not '-10'",
    ),
    "phase too short": (
        "seconds: 25",
        "seconds: 1",
        23,
        "lights at 'market', seconds: this must be a number of seconds from 3 to 300, not '1'",
    ),
    "phase of nobody": (
        PHASE_1,
        "{seconds: 25}",
        23,
        "lights at 'market': the phase names no street; add 'green: [...]' or 'left: [...]'",
    ),
    "phase of a word": (
        PHASE_1,
        "{green: Grand Avenue, seconds: 25}",
        23,
        "a list of streets, not 'Grand Avenue'; put it into brackets: [Grand Avenue]",
    ),
    "phase of an unknown street": (
        PHASE_1,
        "{green: [Grand Avenu], seconds: 25}",
        23,
        "unknown street 'Grand Avenu'|did you mean 'Grand Avenue'?",
    ),
    "phase of a street elsewhere": (
        PHASE_1,
        "{green: [Ford Lane], seconds: 25}",
        23,
        "'Ford Lane' does not run through 'market'; name a street that does: Grand Avenue, King Street, Market",
    ),
    "phase of a street that leaves": (
        PHASE_1,
        "{green: [King Street], seconds: 25}",
        23,
        "'King Street' only leaves 'market' (it is one-way) and needs no green; remove it",
    ),
    "phase with a street twice": (
        PHASE_1,
        "{green: [Grand Avenue, Grand Avenue], seconds: 25}",
        23,
        "'Grand Avenue' is there twice",
    ),
    "left without a turn lane": (
        PHASE_2,
        "{left: [Market Street], seconds: 8}",
        24,
        "'Market Street' has no turn lane at 'market'; add it to the 'turn_lanes'",
    ),
    "left and green": (
        PHASE_1,
        "{green: [Grand Avenue], left: [Grand Avenue], seconds: 25}",
        23,
        "'Grand Avenue' is in the 'green' of this phase already",
    ),
    "never green": (
        "green: [Market Street]",
        "green: [Grand Avenue]",
        23,
        "lights at 'market': 'Market Street' never gets green; name it in the 'green' of a phase",
    ),
    # Signs, crosswalks, sites
    "stop at lights": (
        "stops: [[corner, South Road]]",
        "stops: [[cross, Ford Lane]]",
        26,
        "stops: 'cross' has lights (line 19); remove this sign or the lights",
    ),
    "stop and yield": (
        "- [hill, Market Street]",
        "- [corner, South Road]",
        28,
        "yields: 'South Road' has a stop sign at 'corner' already; remove one of the two",
    ),
    "stop twice": (
        "[[corner, South Road]]",
        "[[corner, South Road], [corner, South Road]]",
        26,
        "stops: it is there twice (first in line 26); remove one",
    ),
    "yield at a roundabout": (
        "- [hill, Market Street]",
        "- [circus, East Road]",
        28,
        "yields: the entries of roundabout 'circus' have yield signs by themselves; remove",
    ),
    "yield in one bracket": (
        "yields:\n  - [hill, Market Street]",
        "yields: [hill, Market Street]",
        27,
        "yields: this must be [junction, street], each pair in its own brackets, not 'hill'",
    ),
    "crosswalk of a street elsewhere": (
        "[[cross, Ford Lane]]",
        "[[cross, East Road]]",
        29,
        "crosswalks: 'East Road' does not run through 'cross'; name a street that does: Grand Avenue, Ford",
    ),
    "crosswalk of nothing": (
        "[[cross, Ford Lane]]",
        "[[cross, Frod Lane]]",
        29,
        "crosswalks: unknown street 'Frod Lane'|did you mean 'Ford Lane'?",
    ),
    "crosswalk of one": (
        "[[cross, Ford Lane]]",
        "[[cross]]",
        29,
        "crosswalks: this must be [junction, street], each pair in its own brackets, not a list of 1",
    ),
    "site that is a junction": (
        "- [100, 14]",
        "- cross",
        31,
        "sites: this must be a point [x, y] in metres, not 'cross'",
    ),
    "site with a height": (
        "- [100, 14]",
        "- [100, 14, 3]",
        31,
        "sites: this must be a point [x, y] in metres, not a list of 3",
    ),
    "site twice": (
        "- [100, 188]",
        "- [100, 14]",
        32,
        "sites: [100, 14] is there twice (first in line 31); remove one",
    ),
    "no sites": (
        "sites:\n  - [100, 14]\n  - [100, 188]",
        "sites: []",
        30,
        "sites: there is no site; add one, or remove the key",
    ),
}
