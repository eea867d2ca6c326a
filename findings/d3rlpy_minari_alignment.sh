#!/usr/bin/env bash
# d3rlpy 2.8.1 (Minari 0.5.4, Gymnasium 1.0.0): get_minari pairs the actions of an episode with observations of another moment.
#
# Guess before: the transitions are those that Minari stored, or the reader refuses the dataset.
# Seen: a Minari episode has one observation more than actions. d3rlpy joins the observations of all episodes and the actions of all
# episodes, and cuts both at the ends of episodes by the number of actions. In episode k, the observations are k - 1 moments
# too early; after thousands of episodes they belong to other episodes. Nothing warns, and the last observations are not used at all.
# Here episodes of 5 actions whose observations count up from 100, 200, ... and whose actions count 0, 1, 2, 3, 4.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export MINARI_DATASETS_PATH="$folder/datasets" HOME="$folder"
mkdir "$MINARI_DATASETS_PATH"

cat > "$folder/counting.py" <<'PYTHON'
import gymnasium
import numpy as np


class Counting(gymnasium.Env):
    """Observations count up from 100 times the number of the episode; five actions, then the end."""

    observation_space = gymnasium.spaces.Box(0.0, 1e6, (1,), np.float32)
    action_space = gymnasium.spaces.Discrete(5)
    count = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 100 * (self.count // 100 + 1)
        return np.array([self.count], np.float32), {}

    def step(self, action):
        self.count += 1
        return np.array([self.count], np.float32), 1.0, self.count % 100 == 5, False, {}
PYTHON
cat > "$folder/compare.py" <<'PYTHON'
from importlib.metadata import version

import d3rlpy
import gymnasium
import minari

gymnasium.register("Counting-v0", "counting:Counting", max_episode_steps=50)
env = minari.DataCollector(gymnasium.make("Counting-v0"))
for episode in range(3):
    env.reset(seed=episode)
    for action in range(5):
        env.step(action)
stored = list(env.create_dataset(dataset_id="counting/all-v0").iterate_episodes())
read = d3rlpy.datasets.get_minari("counting/all-v0")[0].episodes
first = [[int(x) for x in episode.observations[:5].flatten()] for episode in stored]
given = [[int(x) for x in episode.observations.flatten()] for episode in read]
print(f"d3rlpy {version('d3rlpy')}, Minari {version('minari')}")
for number, (before, after, episode) in enumerate(zip(first, given, read, strict=True), 1):
    print(f"episode {number}: actions {episode.actions.flatten().tolist()}, stored before them {before}, read {after}")
assert first == [[100, 101, 102, 103, 104], [200, 201, 202, 203, 204], [300, 301, 302, 303, 304]]
assert given == [[100, 101, 102, 103, 104], [105, 200, 201, 202, 203], [204, 205, 300, 301, 302]]
PYTHON

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q torch==2.13.0 d3rlpy==2.8.1 gymnasium==1.0.0 'minari[create,hdf5]==0.5.4' numpy==2.4.6 pillow==13.0.0  # Minari imports it, and no extra names it
cd "$folder"
venv/bin/python -W ignore compare.py 2> log | grep -v 'info ' || { tail -5 log; exit 1; }
