"""Mistakes in town files: what is written, and what the message about it has to say.

`WRONG` and `MISPLACED` change the town of `yaml_text`: what stands there, what stands there instead, the line of the
message, and fragments of it, separated by bars. `WRONG_FILES` are whole files: the text, the line, the fragments.
"""

KING = "King Street: {through: [market, corner], one_way: true}"
FORD = "Ford Lane: [cross, gate]"
PHASE_1, PHASE_2 = "{green: [Grand Avenue], seconds: 25}", "{left: [Grand Avenue], seconds: 8}"

# What is wrong without any geometry
WRONG = {
    # Keys
    "unknown key": (
        "speed: 50",
        "sped: 50",
        2,
        "town: unknown key 'sped'; known keys are name, speed,|did you mean 'speed'?",
    ),
    "unknown key unlike any": ("speed: 50", "colour: red", 2, "unknown key 'colour'|remove it"),
    "key with a capital": ("speed: 50", "Speed: 50", 2, "unknown key 'Speed'|did you mean 'speed'?"),
    "key of a street": ("median: 4", "medain: 4", 11, "street 'Grand Avenue'|'medain'|did you mean 'median'?"),
    "key of a junction": ("roundabout: 30", "roundabuot: 30", 9, "junction 'circus'|did you mean 'roundabout'?"),
    "key of lights": ("offset: 10", "ofset: 10", 21, "lights|did you mean 'offset'?"),
    "key of a phase": (PHASE_1, "{gren: [Grand Avenue], seconds: 25}", 23, "lights at 'market'|did you mean 'green'?"),
    "course missing": (
        "{through: [gate, corner], sidewalk: 3}",
        "{sidewalk: 3}",
        14,
        "'South Road': the key 'through' is missing; add",
    ),
    "place missing": (
        "{at: [420, 0], roundabout",
        "{roundabout",
        9,
        "junction 'circus': the key 'at' is missing; add it",
    ),
    "seconds missing": (PHASE_1, "{green: [Grand Avenue]}", 23, "lights at 'market'|the key 'seconds' is missing"),
    "lights nowhere": ("at: market", "phase: market", 20, "lights: unknown key 'phase'|did you mean 'phases'?"),
    "junction twice": (
        "market:",
        "cross:",
        5,
        "junctions: 'cross' is there twice (first in line 4); rename or remove one",
    ),
    "street twice": ("King Street:", "Ford Lane:", 13, "streets: 'Ford Lane' is there twice (first in line 12)"),
    "key twice": ("radius: 40", "radius: 40, radius: 50", 15, "'radius' is there twice (first in line 15)"),
    "key that is a list": (
        FORD,
        "? [a, b]\n  : [cross, gate]",
        12,
        "streets: this must be a name before the colon, not a list of 2",
    ),
    "merge key": (FORD, "<<: {Ford Lane: [cross, gate]}", 12, "merge keys (<<) are not read; write the keys out"),
    "name of spaces": ("name: midtown", "name: '  '", 1, "name: this must be a name, not nothing; write one"),
    "street of spaces": ("Ford Lane:", "'  ':", 12, "streets: this must be a name before the colon, not nothing"),
    "name that is null": ("Ford Lane:", "null:", 12, "null is YAML's word for nothing: put it into quotes, 'null'"),
    "name of two lines": ("name: midtown", 'name: "mid\\ntown"', 1, "name: this must be a name on a single line"),
    # Types and ranges
    "speed in words": ("speed: 50", "speed: fast", 2, "speed: this must be a number of km/h from 5 to 130, not 'fast'"),
    "speed with its unit": (
        "speed: 50",
        "speed: 50 km/h",
        2,
        "a number of km/h from 5 to 130, not '50 km/h'; write it in plain",
    ),
    "speed out of range": ("speed: 60", "speed: 600", 11, "street 'Grand Avenue', speed|from 5 to 130, not '600'"),
    "speed of nothing": ("speed: 50", "speed:", 2, "speed: this must be a number of km/h from 5 to 130, not nothing"),
    "speed that is a list": ("speed: 50", "speed: [50]", 2, "a number of km/h from 5 to 130, not a list of 1"),
    "speed in quotes": ("speed: 50", "speed: '50'", 2, "not a text; remove the quotes around 50"),
    "speed not a number": ("speed: 50", "speed: .nan", 2, "a number of km/h from 5 to 130, not '.nan'"),
    "coordinate without end": (
        "[200, 0]",
        "[.inf, 0]",
        5,
        "junction 'market'|a number of metres from -20000 to 20000, not '.inf'",
    ),
    "coordinate far away": ("[200, 0]", "[200000, 0]", 5, "junction 'market'|from -20000 to 20000, not '200000'"),
    "coordinate yes": (
        "[200, 0]",
        "[yes, 0]",
        5,
        "junction 'market'|a number of metres from -20000 to 20000, not 'yes'",
    ),
    "coordinate with underscore": ("[200, 0]", "[1_000, 0]", 5, "not '1_000'; write it in plain decimal digits"),
    "coordinate as hours": ("[200, 0]", "[12:30, 0]", 5, "not '12:30'; write it in plain decimal digits"),
    "coordinate octal": ("[200, 0]", "[0o17, 0]", 5, "not '0o17'; write it in plain decimal digits"),
    "coordinate with a nought before": ("[200, 0]", "[017, 0]", 5, "not '017'; write it in plain decimal digits"),
    "four coordinates": (
        "[200, 0]",
        "[200, 0, 0, 0]",
        5,
        "'market': this must be a point [x, y] or [x, y, height] in metres, not a list of 4",
    ),
    "coordinates without comma": (
        "[200, 0]",
        "[200 0]",
        5,
        "a point [x, y] or [x, y, height] in metres, not a list of 1",
    ),
    "coordinates missing": ("market: [200, 0]", "market:", 5, "junction 'market'|a point [x, y]|not nothing"),
    "height out of range": (
        "[200, 0]",
        "[200, 0, 9999]",
        5,
        "a number of metres of height from -500 to 9000, not '9999'",
    ),
    "width below nothing": (
        "width: 3.25",
        "width: -3",
        17,
        "street 'Market Street', width|a number of metres from 2.5 to 6, not '-3'",
    ),
    "pavement too wide": ("sidewalk: 3", "sidewalk: 30", 14, "street 'South Road', sidewalk|from 0 to 10, not '30'"),
    "median below nothing": ("median: 4", "median: -4", 11, "street 'Grand Avenue', median|from 0 to 50"),
    "lanes too many": ("lanes: 2, median", "lanes: 5, median", 11, "'Grand Avenue', lanes|from 1 to 4, not '5'"),
    "lanes halved": (
        "lanes: 2, median",
        "lanes: 1.5, median",
        11,
        "a whole number of lanes in one direction from 1 to 4, not '1.5'",
    ),
    "lanes of three directions": (
        "lanes: 2, median",
        "lanes: [1, 2, 3], median",
        11,
        "a number of lanes, or [forward, backward], not a list of 3",
    ),
    "no lanes backward": ("lanes: 2, median", "lanes: [2, 0], median", 11, "from 1 to 4, not '0'|one_way: true"),
    "one-way maybe": (
        "one_way: true",
        "one_way: maybe",
        13,
        "'King Street', one_way: this must be true or false, not 'maybe'",
    ),
    "radius in words": (
        "radius: 40",
        "radius: wide",
        15,
        "street 'East Road', radius: this must be a number of metres",
    ),
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
        "'circus' is a roundabout, where nobody turns left; remove it",
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
    # YAML
    "bracket not closed": (
        FORD,
        "Ford Lane: [cross, gate",
        12,
        "is not YAML: the bracket that opens here is not closed before line 13",
    ),
    "quote not closed": ("name: midtown", "name: 'midtown", 1, "is not YAML: the quote that opens here is not closed"),
    "tab": ("  Ford Lane", "\tFord Lane", 12, "is not YAML: the line is indented with a tab; use spaces"),
    "colon missing": ("speed: 50", "speed 50", 3, "is not YAML|line above"),
    "control character": ("midtown", "mid\x07town", 1, "is not YAML: character '\\x07' is in it; remove it"),
    "alias": (
        FORD,
        "Ford Lane: &ford [cross, gate]\n  Ford Street: *ford",
        13,
        "the alias *ford stands for text elsewhere; write the text out instead",
    ),
    "second town": ("streets:", "---\nstreets:", 10, "a second document starts here ('---'); keep one town in a file"),
}

LOW_ROAD = f"{FORD}\n  Low Road: [hill, [100, -50], [100, 100], gate]"
SOUTH = "{through: [gate, corner], sidewalk: 3}"

# What does not fit into its place
MISPLACED = {
    "junctions too close": (
        "gate: [0, 200]",
        "gate: [0, 22]",
        6,
        "junction 'gate': it is 22.0 m from 'cross', closer than their radii of|move them apart or make one junction",
    ),
    "no room between junctions": (
        "gate: [0, 200]",
        "gate: [0, 30]",
        12,
        "'Ford Lane': between 'cross' and 'gate' there is no room|further apart",
    ),
    "street through nowhere": (
        "  hill:",
        "  attic: [300, 90]\n  hill:",
        8,
        "junction 'attic': no street runs through it; put it into the course of one, or remove it",
    ),
    "streets at a small angle": (
        FORD,
        "Ford Lane: [cross, [60, 40], gate]",
        4,
        "junction 'cross': streets 'Grand Avenue' and 'Ford Lane' leave it only 34 degrees apart|move the next point",
    ),
    "points in one place": (
        FORD,
        "Ford Lane: [cross, [0, 90], [0, 90.5], gate]",
        12,
        "[0.0, 90.0] and [0.0, 90.5] of its course are less than 1 m apart; remove one",
    ),
    "curve tighter than the lanes are wide": (
        "radius: 40",
        "radius: 4",
        15,
        "street 'East Road': the bend at [420.0, 200.0]|tighter than its lanes are wide: radius 4|give a larger radius",
    ),
    "hairpin": (
        FORD,
        "Ford Lane: [cross, [0, 100], [9, 20], gate]",
        12,
        "the bend at [0.0, 100.0]|tighter than its lanes are wide|make the turn gentler",
    ),
    "radius without room": (
        "radius: 40",
        "radius: 400",
        15,
        "the bend at [420.0, 200.0]|has no room for radius 400 m; at most",
    ),
    "streets that touch": (
        FORD,
        "Ford Lane: [cross, [0, 60], [195, 60], [195, 140], [0, 140], gate]",
        13,
        "'King Street': between 'market' and 'corner' it touches street 'Ford Lane' near [|move one of them away",
    ),
    "streets that cross on one level": (
        FORD,
        LOW_ROAD,
        13,
        "'Low Road': between 'hill' and 'gate' it touches street 'Grand Avenue' near [|put a junction there|4.5 m",
    ),
    "street too low above another": (
        FORD,
        LOW_ROAD.replace("[100, -50], [100", "[100, -50, 4], [100, 50, 4], [100"),
        13,
        "touches street 'Grand Avenue'|lead one 4.5 m above the other",
    ),
    "too steep": (
        "hill: [200, -150]",
        "hill: [200, -150, 40]",
        16,
        "street 'North Road'|it climbs too steeply: |at most 12 % are possible; make the way longer",
    ),
    "lanes into a dead end": (
        FORD,
        "Ford Lane: {through: [cross, gate], one_way: true, lanes: 3}",
        14,
        "street 'South Road': it leads to 'gate' and no way goes on|make it two-way",
    ),
    "street that nobody reaches": (
        FORD,
        "Ford Lane: {through: [gate, cross], one_way: true}\n  Lane: {through: [gate, [60, 140], corner], one_way: on}",
        15,
        "street 'South Road': it leaves 'gate' and there is no way into it: nobody|turn a one-way street round",
    ),
    "sign where a street only leaves": (
        f"South Road: {SOUTH}",
        "South Road: {through: [corner, gate], one_way: true}",
        26,
        "stops: 'South Road' only leaves 'corner' (it is one-way); remove the sign",
    ),
    "ring too small for its lanes": (
        "roundabout: 30, lanes: 1",
        "roundabout: 10, lanes: 3",
        9,
        "junction 'circus': its ring is too small: its innermost lane has a radius of 6.5 m|give it a radius of 11.5 m",
    ),
    "ring too small for its arms": (
        "roundabout: 30",
        "roundabout: 12",
        9,
        "junction 'circus': the streets that meet its ring|too close together|larger radius",
    ),
    "point inside of the ring": (
        "market, circus]",
        "market, [400, 3], circus]",
        11,
        "point next to 'circus' lies inside of that roundabout's ring; move it further out",
    ),
    "ramp at a large angle": (
        "one_way: true",
        "ramp: true",
        13,
        "'King Street': it is a ramp, but neither leaves nor joins a street at a small angle (from 12 to 45 degrees)",
    ),
    "turn lane without room": (
        "market: [200, 0]",
        "market: [56, 0]",
        11,
        "'Grand Avenue': between 'cross' and 'market' there is no room for the turn lane before",
    ),
    "site far from every street": (
        "- [100, 14]",
        "- [100, 90]",
        31,
        "sites: it is 82.8 m from the nearest street; 25 m are possible: move it",
    ),
    "site on the road": ("- [100, 14]", "- [100, 5]", 31, "sites: it stands on the road; move it aside"),
    "site in the median": ("- [100, 14]", "- [120, 0]", 31, "sites: |a median; move it to the side of a street"),
    "site at a junction": ("- [100, 14]", "- [194, 12]", 31, "sites: |a junction; move it to the side of a street"),
    "turn lane to nowhere": (
        SOUTH,
        "{through: [gate, corner], median: 5, turn_lanes: [corner]}",
        14,
        "'South Road': it has a turn lane before 'corner', where nothing goes left; remove it",
    ),
}

TWO = "junctions: {a: [0, 0], b: [200, 0]}\n"
ROAD = TWO + "streets: {Road: [a, b], Lane: {through: [a, [100, 80], b], one_way: true}}\n"

WRONG_FILES = {
    "empty": ("# nothing\n", None, "file: is empty; give it junctions and streets"),
    "a list": ("[1, 2]", 1, "town: this must be keys and values (name,|not a list of 2"),
    "a word": ("town", 1, "town: this must be keys and values|not 'town'"),
    "no junction": ("junctions: {}\nstreets: {}", 1, "junctions: there is no junction; add one"),
    "no street": (TWO + "streets: {}", 2, "streets: there is no street; add one"),
    "streets as list": (TWO + "streets: [a, b]", 2, "streets: this must be streets by name|not a list of 2"),
    "streets missing": (TWO, 1, "town: the key 'streets' is missing; add it"),
    "dead end": (
        TWO + "streets: {Road: [a, b]}",
        1,
        "junction 'a': street 'Road' ends here and nothing goes on|lead another",
    ),
    "nowhere to go on": (
        ROAD.replace("Road: [a, b]", "Road: {through: [a, b], one_way: true}"),
        2,
        "street 'Road': it leaves 'a' and there is no way into it|make it two-way",
    ),
    "street into itself": (
        TWO + "streets:\n  Loop: [a, [150, 0], [150, 90], [60, 90], [60, -90], [200, -90], b]\n"
        "  Lane: [a, [0, 200], [200, 200], b]\n",
        3,
        "street 'Loop': between 'a' and 'b' it runs into itself|move its points apart",
    ),
    "junction run over": (
        "junctions: {a: [0, 0], b: [200, 0], c: [100, 10], d: [100, 100]}\n"
        "streets: {A: [a, b], B: [c, d], C: [a, [0, 100], d, [200, 100], b], D: [c, [150, 50], d]}",
        2,
        "street 'A': between 'a' and 'b' it runs over junction 'c' without naming it; name it in the course, keep away",
    ),
    "lights as keys": (ROAD + "lights: {a: 30}", 3, "lights: this must be a list of junctions, not keys and values"),
    "no phase": (ROAD + "lights: [{at: a, phases: []}]", 3, "lights at 'a': there is no phase; add one, or remove"),
    "sign where a street only leaves": (ROAD + "stops: [[a, Lane]]", 3, "'Lane' only leaves 'a' (it is one-way)"),
    "crosswalk of a ramp": (
        ROAD.replace("one_way", "ramp") + "crosswalks: [[b, Lane]]",
        3,
        "crosswalks: 'Lane' is a ramp, which nobody crosses on foot; remove it or name another street",
    ),
    "not UTF-8": (b"name: x\nspeed: \xff\xfe", 2, "is not UTF-8 text (byte 15 of the file); save the file as UTF-8"),
    "UTF-16": (ROAD.encode("utf-16"), 1, "is not UTF-8 text (byte 0 of the file)"),
    "too large": ("#" * 1_000_001, None, "is larger than 1000 kB; name a town file (.yaml)"),
    "nested without end": ("name: " + "[" * 500_000, 1, "lists are nested more than 20 deep; check the brackets"),
    "a billion laughs": (
        "a: &a [lol, lol]\nb: &b [*a, *a]\nc: &c [*b, *b]\n",
        2,
        "the alias *a stands for text elsewhere; write the text out instead",
    ),
}
