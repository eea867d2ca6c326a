#!/usr/bin/env bash
# SUMO 1.28.0 (eclipse-sumo of PyPI): netgenerate cannot write a left-hand network as OpenDRIVE.
#
# Guess before: netgenerate has the options --lefthand and --opendrive-output, so that both together write a left-hand map.
# Seen: each option works alone. Together netgenerate ends with code 1 and "No option with the name
# 'opendrive-output.lefthand-left' exists": the exporter asks for an option, for left-hand networks only, that netconvert has and
# netgenerate does not. netgenerate refuses the option itself, too. The way round is netgenerate --lefthand -o FILE.net.xml,
# and then netconvert -s FILE.net.xml --opendrive-output FILE.xodr.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

python3 -m venv venv
venv/bin/pip install -q eclipse-sumo==1.28.0 sumo-data==1.28.0
venv/bin/netgenerate --version | sed -n 1p
grid=(--grid --grid.number 3 --grid.length 100)

venv/bin/netgenerate "${grid[@]}" --opendrive-output right.xodr > log 2>&1
venv/bin/netgenerate "${grid[@]}" --lefthand -o left.net.xml >> log 2>&1
code=0
venv/bin/netgenerate "${grid[@]}" --lefthand --opendrive-output left.xodr > log 2>&1 || code=$?
sed -n 1,2p log
[ "$code" = 1 ] && grep -q "No option with the name 'opendrive-output.lefthand-left' exists" log || { echo "changed: code $code"; exit 1; }
if venv/bin/netgenerate "${grid[@]}" --lefthand --opendrive-output.lefthand-left --opendrive-output left.xodr > log 2>&1; then
    echo "changed: the option is known"; exit 1
fi
venv/bin/netconvert -s left.net.xml --opendrive-output left.xodr > log 2>&1
grep -q "</OpenDRIVE>" left.xodr
echo "as found"
