#!/usr/bin/env bash
# hibari-tts 0.2.1 (numpy 2.4.6, onnxruntime 1.26.0): an utterance with a fixed seed has other samples on another processor.
#
# Guess before: with equal text, seed and onnxruntime kernels, the samples are equal; numpy rounds equally everywhere.
# Seen: without numpy's vector routines above its baseline (its own switch NPY_DISABLE_CPU_FEATURES, as on a processor without
# AVX2) the number of samples is equal, but some 80 % of the samples differ, by up to 6e-8. hibari's signal processing (dsp.py)
# takes float32 sin, cos, exp and tanh from numpy. A recording is therefore no proof of how it was made, and hashes of
# synthesised audio do not carry over between machines.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q numpy==2.4.6 onnxruntime==1.26.0 hibari-tts==0.2.1

cat > "$folder/speak.py" <<'PYTHON'
import sys
import hibari
import numpy as np

np.save(sys.argv[1], np.asarray(hibari.Hibari(threads=1)("Turn left at the church.", seed=1)))
PYTHON
cat > "$folder/features.py" <<'PYTHON'
import numpy._core._multiarray_umath as numpy_features

print(*(name for name in numpy_features.__cpu_dispatch__ if numpy_features.__cpu_features__[name]))
PYTHON
cat > "$folder/compare.py" <<'PYTHON'
import sys
import numpy as np

one, again, other = (np.load(name) for name in sys.argv[1:])
share = float((one != other).mean())
print(f"{len(one)} and {len(other)} samples; repeated: equal {np.array_equal(one, again)}; "
      f"without vector routines: {100 * share:.0f} % differ, by up to {np.abs(one - other).max():.1e}")
assert np.array_equal(one, again) and len(one) == len(other) and 0.2 < share and np.abs(one - other).max() < 1e-5
PYTHON

python="$folder/venv/bin/python"
features=$("$python" "$folder/features.py")
[ -n "$features" ] || { echo "this processor has no vector routines above numpy's baseline: nothing to compare"; exit 0; }
"$python" "$folder/speak.py" "$folder/one.npy"
"$python" "$folder/speak.py" "$folder/again.npy"
NPY_DISABLE_CPU_FEATURES="$features" "$python" "$folder/speak.py" "$folder/other.npy"
"$python" "$folder/compare.py" "$folder/one.npy" "$folder/again.npy" "$folder/other.npy"
