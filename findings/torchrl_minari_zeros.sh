#!/usr/bin/env bash
# TorchRL 0.14.1 (Minari 0.5.4, torch 2.13.0): MinariExperienceReplay fills a buffer of the right shape with zeros.
#
# Guess before: the buffer holds what Minari stored, as it does in TorchRL 0.10.1, or the reader fails.
# Seen: shapes, types, keys, number of steps and the progress bar are right, and every observation, action and reward is 0.
# A learner trains on it without a warning. The reader copies the steps into a tensordict, and returns the files that it
# allocates afterwards, into which nothing is copied. 0.11.0, 0.11.1 and 0.14.1 do so. Here with CartPole of Gymnasium.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export MINARI_DATASETS_PATH="$folder/datasets" HOME="$folder"
mkdir "$MINARI_DATASETS_PATH"

cat > "$folder/collect.py" <<'PYTHON'
import gymnasium
import minari

env = minari.DataCollector(gymnasium.make("CartPole-v1"))
env.action_space.seed(1)
for seed in range(3):
    env.reset(seed=seed)
    ended = False
    while not ended:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated
env.create_dataset(dataset_id="cartpole/random-v0")
PYTHON
cat > "$folder/compare.py" <<'PYTHON'
import sys
from importlib.metadata import version

import minari
import numpy as np
from torchrl.data.datasets.minari_data import MinariExperienceReplay

episodes = list(minari.load_dataset("cartpole/random-v0").iterate_episodes())
stored = np.concatenate([episode.observations[:-1] for episode in episodes])
replay = MinariExperienceReplay(
    "cartpole/random-v0", batch_size=4, load_from_local_minari=True, download=False, root=sys.argv[1]
)
read = replay[:]["observation"].numpy()
print(f"TorchRL {version('torchrl')}: stored {stored.shape}, sum of |x| {np.abs(stored).sum():.2f}; "
      f"read {read.shape}, sum of |x| {np.abs(read).sum():.2f}; rewards {float(replay[:]['next', 'reward'].sum()):.0f}")
assert read.shape == stored.shape
assert np.array_equal(read, stored) if sys.argv[2] == "right" else not read.any() and stored.any()
PYTHON

for release in "0.10.1 0.10.0 right" "0.14.1 0.14.3 zeros"; do
    read -r torchrl tensordict expected <<< "$release"
    python3 -m venv "$folder/$torchrl"
    "$folder/$torchrl/bin/pip" install -q torch==2.13.0 torchrl=="$torchrl" tensordict=="$tensordict" 'minari[create,hdf5]==0.5.4' gymnasium==1.4.0 numpy==2.4.6 pillow==13.0.0  # Minari imports it, and no extra names it
    [ -e "$MINARI_DATASETS_PATH/cartpole" ] || "$folder/$torchrl/bin/python" -W ignore "$folder/collect.py"
    "$folder/$torchrl/bin/python" -W ignore "$folder/compare.py" "$folder/replay-$torchrl" "$expected" 2> "$folder/log" || { tail -5 "$folder/log"; exit 1; }
done
