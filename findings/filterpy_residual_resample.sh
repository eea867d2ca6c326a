#!/usr/bin/env bash
# FilterPy 2.0.0: residual resampling of 49 particles of equal weight loses about a third of them.
#
# Guess before: residual resampling keeps floor(N w) copies of each particle and draws only the rest, so that N particles
# of weight 1/N are all kept, whatever N is; that is what it is chosen for.
# Seen: for 20 sizes below 400 (49, 98, 103, 107, 161, ...) floor(N * (1 / N)) is 0, because 49 * (1 / 49) is below 1 in
# floating point. Then no copy is certain, all particles are drawn at random, and a third of them is gone after one step.
# For most other sizes all are kept, beside a warning of a division by zero: nothing is left to draw.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 filterpy==2.0.0

cat > "$folder/resample.py" <<'PYTHON'
import numpy as np
from filterpy.monte_carlo import residual_resample

np.random.seed(0)
kept = {}
for size in range(1, 400):
    with np.errstate(invalid="ignore"):
        kept[size] = len(set(residual_resample(np.full(size, 1.0 / size))))
lost = {size: number for size, number in kept.items() if number < size}
print("particles of equal weight, and how many are left:", lost)
assert list(lost)[:5] == [49, 98, 103, 107, 161] and len(lost) == 20
assert all(0.5 < number / size < 0.8 for size, number in lost.items())
PYTHON
"$folder/venv/bin/python" "$folder/resample.py"
