#!/usr/bin/env bash
# segeval 2.0.11 and NLTK 3.10.4: Pk of the same two segmentations differs, since the default windows differ.
#
# Guess before: both packages give the same Pk (Beeferman et al. 1999) of two annotators who divide 25 utterances of a dialogue
# into exchanges, and the boundary similarity of two annotators who agree is 1.
# Seen:
# - both take half the mean length of the reference's segments as window. segeval divides units by segments, NLTK divides the
#   places between units by the boundaries, of which there is one less each: the window is larger where segments are few;
# - Pk with the same window is equal. With the defaults, half of random pairs with one to eight boundaries get
#   different values, and with one boundary, NLTK's window is twice as long;
# - two annotators who both see one exchange, without a boundary, have no boundary similarity: ValueError by max() of an empty
#   sequence, while Pk and WindowDiff are 0.
# A Pk needs the window beside it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q numpy==1.26.4 segeval==2.0.11 nltk==3.10.4
cd "$folder"

cat > windows.py <<'PYTHON'
import random

import segeval
from nltk.metrics.segmentation import pk


def masses(places):
    """Returns the lengths of the segments between boundaries, "1" in a text of the places between units."""
    return tuple(len(part) + 1 for part in places.split("1"))


def both(reference, other):
    return pk(reference, other), float(segeval.pk(masses(other), masses(reference)))


reference, other = "000100000010000110000000", "000001100010011001001001"
print("segments", masses(reference), "and", masses(other), "Pk by NLTK and segeval:", *map("{:.3f}".format, both(reference, other)))
assert both(reference, other)[0] != both(reference, other)[1]
window = segeval.compute_window_size(masses(reference))
print("segeval's window:", window, "Pk of both with it:", pk(reference, other, window))
assert abs(pk(reference, other, window) - both(reference, other)[1]) < 1e-9

random.seed(4)
different = 0
for _ in range(1000):
    count = random.randint(1, 8)
    pair = []
    for _ in range(2):
        at = set(random.sample(range(24), count))
        pair.append("".join("1" if place in at else "0" for place in range(24)))
    first, second = both(*pair)
    different += abs(first - second) > 1e-9
print(f"{different} of 1000 random pairs have different values")
assert 400 < different < 900

try:
    segeval.boundary_similarity((25,), (25,))
    raise SystemExit("two segmentations without a boundary have a similarity")
except ValueError as error:
    print("boundary similarity of two annotators without a boundary:", error)
assert float(segeval.pk((25,), (25,))) == float(segeval.window_diff((25,), (25,))) == 0.0
PYTHON
venv/bin/python windows.py
