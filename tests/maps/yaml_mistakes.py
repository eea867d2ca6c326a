"""Mistakes in the notation of town files, with the expected messages.

`MISWRITTEN`, and `WRONG` and `MISPLACED` of the files beside, change the town of `yaml_text`: what stands there, what
stands there instead, the line of the message, and fragments of it, separated by bars. `WRONG_FILES` are whole files:
the text, the line, the fragments.
"""

FORD = "Ford Lane: [cross, gate]"
PHASE_1 = "{green: [Grand Avenue], seconds: 25}"

MISWRITTEN = {
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
        "junction 'a': street 'Road' ends here and no street continues|lead another",
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
        "crosswalks: 'Lane' is a ramp, which has no crosswalks; remove it or name another street",
    ),
    "not UTF-8": (b"name: x\nspeed: \xff\xfe", 2, "is not UTF-8 text (byte 15 of the file); save the file as UTF-8"),
    "UTF-16": (ROAD.encode("utf-16"), 1, "is not UTF-8 text (byte 0 of the file)"),
    "too large": ("#" * 1_000_001, None, "is larger than 1000 kB, the limit of its kind"),
    "nested without end": ("name: " + "[" * 500_000, 1, "lists are nested more than 20 deep; check the brackets"),
    "a billion laughs": (
        "a: &a [lol, lol]\nb: &b [*a, *a]\nc: &c [*b, *b]\n",
        2,
        "the alias *a stands for text elsewhere; write the text out instead",
    ),
}
