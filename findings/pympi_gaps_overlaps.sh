#!/usr/bin/env bash
# pympi-ling 1.71: its two functions for gaps and overlaps of two speakers find different gaps in the same ELAN file.
#
# Guess before: `Eaf.get_gaps_and_overlaps2`, described as the faster variant of `get_gaps_and_overlaps` (pauses, gaps and
# overlaps after Heldner and Edlund 2010), yields the same intervals.
# Seen:
# - each gap and pause of the slower one begins 1 ms later and ends 1 ms earlier: a gap of 500 ms has 498 ms, and one of
#   1 ms is left out; overlaps have their full length in both;
# - a speaker who starts in the very millisecond in which the other one stops overlaps by 0 ms for the slower one; the
#   faster one yields nothing for that change of speakers;
# - two adjoining annotations of one speaker are a pause of 0 ms for the faster one, and nothing for the slower one.
# Means of turn-taking times, and counts of overlaps, thus depend on which one is called.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q pympi-ling==1.71
cd "$folder"

cat > gaps.py <<'PYTHON'
import random

from pympi.Elan import Eaf


def found(driver, passenger):
    file = Eaf(author="nobody")
    for tier, talk in (("driver", driver), ("passenger", passenger)):
        file.add_tier(tier)
        for start, end in talk:
            file.add_annotation(tier, start, end, "words")
    both = []
    for name in ("get_gaps_and_overlaps", "get_gaps_and_overlaps2"):
        both.append([(s, e, kind.split("_")[0]) for s, e, kind in getattr(file, name)("driver", "passenger")])
        print(f"{name:24} {both[-1]}")
    return both


print("a gap of 500 ms, and an overlap of 200 ms")
assert found([(0, 1000), (2300, 3000)], [(1500, 2500)]) == [
    [(1001, 1499, "G12"), (2300, 2500, "O21")],
    [(1000, 1500, "G12"), (2300, 2500, "O21")],
]
print("a gap of 1 ms")
assert found([(0, 1000)], [(1001, 1500)]) == [[], [(1000, 1001, "G12")]]
print("the passenger starts when the driver stops")
assert found([(0, 1000)], [(1000, 1500)]) == [[(1000, 1000, "O12")], []]
print("the driver's annotations adjoin")
assert found([(0, 1000), (1000, 2000)], [(2500, 3000)]) == [
    [(2001, 2499, "G12")],
    [(1000, 1000, "P1"), (2000, 2500, "G12")],
]

print("an hour of random talk")
random.seed(5)
talk = []
for _ in range(2):
    time, own = 0, []
    while time < 3_600_000:
        start = time + random.randint(200, 4000)
        time = start + random.randint(300, 5000)
        own.append((start, time))
    talk.append(own)
slow, fast = found(*talk)
means = []
for name, rows in (("slower", slow), ("faster", fast)):
    lengths = [end - start for start, end, kind in rows if kind[0] in "GP"]
    means.append(sum(lengths) / len(lengths))
    print(f"{name}: {len(lengths)} gaps and pauses, {means[-1]:.1f} ms on average")
assert 1.8 < means[1] - means[0] < 2.2
PYTHON
venv/bin/python gaps.py | cut -c 1-160
