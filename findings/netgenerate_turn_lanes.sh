#!/usr/bin/env bash
# SUMO 1.28.0 (eclipse-sumo of PyPI): turn lanes of netgenerate are much shorter than --turn-lanes.length says.
#
# Guess before: with --turn-lanes 1 the turn lane before each junction is 20 m long, the default of --turn-lanes.length, or a little
# shorter.
# Seen in grids of 3 x 3 junctions with streets of 200 m: 7.2, 4.0, 0.8 and 0.2 m for streets with 1, 2, 3 and 4 lanes in each
# direction, with lights or without. The length counts from the middle of the junction, not from the stop line, so that the
# junction, which grows by 3.2 m with each lane, takes nearly all of it; with --turn-lanes.length 40 the lanes are 27.2, 24.0, 20.8
# and 17.6 m long. netgenerate does not warn, and writes the lanes into OpenDRIVE files as driving lanes of roads of 0.8 or 0.2 m, on
# which no car fits.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

cat > measure.py <<'PYTHON'
import sys
import xml.etree.ElementTree as ElementTree

network, exported, lanes = ElementTree.parse(sys.argv[1]).getroot(), ElementTree.parse(sys.argv[2]).getroot(), int(sys.argv[3])
streets = [edge.findall("lane") for edge in network.findall("edge") if edge.get("function") != "internal"]
widened = {round(float(lane.get("length")), 2) for edge in streets if len(edge) == lanes + 1 for lane in edge}
roads = {
    round(float(road.get("length")), 2)
    for road in exported.iter("road")
    if road.get("junction") == "-1" and len(road.findall("lanes/laneSection/right/lane[@type='driving']")) == lanes + 1
}
[length], [road] = widened, roads
assert length == road
print(f"{length:.1f}")
PYTHON

python3 -m venv venv
venv/bin/pip install -q eclipse-sumo==1.28.0 sumo-data==1.28.0
venv/bin/netgenerate --version | sed -n 1p
found=""
for asked in 20 40; do
    for lanes in 1 2 3 4; do
        venv/bin/netgenerate --grid --grid.number 3 --grid.length 200 -L "$lanes" --turn-lanes 1 --turn-lanes.length "$asked" \
            -o grid.net.xml > log 2>&1
        venv/bin/netconvert -s grid.net.xml --opendrive-output grid.xodr >> log 2>&1
        if grep -i warning log; then echo "netgenerate now warns"; exit 1; fi
        length=$(venv/bin/python measure.py grid.net.xml grid.xodr "$lanes")
        echo "asked for $asked m, streets of $lanes lanes: turn lanes of $length m"
        found="$found $length"
    done
done
[ "$found" = " 7.2 4.0 0.8 0.2 27.2 24.0 20.8 17.6" ] || { echo "changed:$found"; exit 1; }
echo "as found"
