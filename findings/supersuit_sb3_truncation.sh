#!/usr/bin/env bash
# SuperSuit 3.11.0 (PettingZoo 1.27.0, stable-baselines3 2.9.2): PPO of stable-baselines3 learns that truncated episodes end.
#
# Guess before: a PettingZoo environment made into a vector environment of stable-baselines3 is learned like the same Gymnasium
# environment, whose truncation is followed by the value of the last observation.
# Seen: the last observation is handed over, but not `TimeLimit.truncated`, which stable-baselines3 asks for. Every reward is 1, every episode is
# truncated after 3 actions and never ends by itself, and gamma is 0.9: the value is 1 / (1 - 0.9) = 10 with Gymnasium, and about 1.9, the mean of
# 1, 1.9 and 2.71, with SuperSuit. Nothing warns.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export HOME="$folder"

cat > "$folder/compare.py" <<'PYTHON'
from importlib.metadata import version

import gymnasium
import numpy as np
import supersuit
import torch
from pettingzoo import ParallelEnv
from stable_baselines3 import PPO
from stable_baselines3.common.utils import set_random_seed

LENGTH = 3
SPACES = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32), gymnasium.spaces.Discrete(2)
NOTHING = np.zeros(1, np.float32)


class Single(gymnasium.Env):
    observation_space, action_space = SPACES

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.time = 0
        return NOTHING, {}

    def step(self, action):
        self.time += 1
        return NOTHING, 1.0, False, self.time == LENGTH, {}


class Pair(ParallelEnv):
    metadata, render_mode, possible_agents = {"name": "pair", "render_modes": []}, None, ["a", "b"]

    def observation_space(self, agent):
        return SPACES[0]

    def action_space(self, agent):
        return SPACES[1]

    def reset(self, seed=None, options=None):
        self.agents, self.time = list(self.possible_agents), 0
        return dict.fromkeys(self.agents, NOTHING), {agent: {} for agent in self.agents}

    def step(self, actions):
        self.time += 1
        agents, over = self.agents, self.time == LENGTH
        self.agents = [] if over else agents
        each = [dict.fromkeys(agents, value) for value in (NOTHING, 1.0, False, over)]
        return *each, {agent: {} for agent in agents}


def value(env):
    set_random_seed(0)  # PPO(seed=...) needs a method that the vector environment lacks
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, gamma=0.9, gae_lambda=1.0, learning_rate=3e-3, vf_coef=1.0, device="cpu")
    model.learn(8_000)
    return float(model.policy.predict_values(torch.zeros(1, 1)))


pair = supersuit.pettingzoo_env_to_vec_env_v1(Pair())
vector = supersuit.concat_vec_envs_v1(pair, 1, num_cpus=1, base_class="stable_baselines3")
with_gymnasium, with_supersuit = value(Single()), value(vector)
print(f"SuperSuit {version('supersuit')}, stable-baselines3 {version('stable-baselines3')}: "
      f"value {with_gymnasium:.1f} with Gymnasium, {with_supersuit:.1f} with SuperSuit")
assert with_gymnasium > 7 and with_supersuit < 3
PYTHON

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q torch==2.13.0 supersuit==3.11.0 pettingzoo==1.27.0 stable-baselines3==2.9.2 gymnasium==1.3.0 numpy==2.4.6
"$folder/venv/bin/python" -W ignore "$folder/compare.py" 2> "$folder/log" || { tail -5 "$folder/log"; exit 1; }
