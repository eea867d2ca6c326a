"""Mistakes in plans that the layout detects: elements that do not fit."""

FORD = "Ford Lane: [cross, gate]"
LOW_ROAD = f"{FORD}\n  Low Road: [hill, [100, -50], [100, 100], gate]"
SOUTH = "{through: [gate, corner], sidewalk: 3}"

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
        "street 'South Road': it leads to 'gate' and no street continues|make it two-way",
    ),
    "unreachable street": (
        FORD,
        "Ford Lane: {through: [gate, cross], one_way: true}\n  Lane: {through: [gate, [60, 140], corner], one_way: on}",
        15,
        "street 'South Road': it leaves 'gate' and there is no way into it: its lanes|turn a one-way street round",
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
