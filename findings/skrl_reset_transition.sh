#!/usr/bin/env bash
# skrl 2.1.1 (Gymnasium 1.4.0, torch 2.13.0): with a Gymnasium vector environment, the memory of an agent holds a
# transition from the last observation of each episode to the first of the next.
#
# Guess before: resets are left out of the memory, as for a single environment, whose reset is a call of its own.
# Seen: vector environments of Gymnasium 1 reset with the action after the end of an episode, and that action does nothing. skrl
# records it with reward 0 as not terminated, one in every episode. Values of the next episode reach the end of an
# episode that was truncated by a path that does not exist. Here episodes of 5 actions whose observations count up from 100, 200, ...
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export HOME="$folder"

cat > "$folder/counting.py" <<'PYTHON'
import gymnasium
import numpy as np


class Counting(gymnasium.Env):
    """Observations count up from 100 times the number of the episode; five actions, then truncation."""

    observation_space = gymnasium.spaces.Box(0.0, 1e6, (1,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)
    count = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 100 * (self.count // 100 + 1)
        return np.array([self.count], np.float32), {}

    def step(self, action):
        self.count += 1
        return np.array([self.count], np.float32), 1.0, False, self.count % 100 == 5, {}
PYTHON
cat > "$folder/record.py" <<'PYTHON'
from importlib.metadata import version

import gymnasium
import torch
from skrl.agents.torch.dqn import DQN, DQN_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, Model
from skrl.trainers.torch import SequentialTrainer, SequentialTrainerCfg

STEPS = 12
gymnasium.register("Counting-v0", "counting:Counting")


class Values(DeterministicMixin, Model):
    def __init__(self, env):
        Model.__init__(self, observation_space=env.observation_space, action_space=env.action_space, device="cpu")
        DeterministicMixin.__init__(self)
        self.net = torch.nn.Linear(self.num_observations, self.num_actions)

    def compute(self, inputs, role):
        return self.net(inputs["observations"]), {}


def recorded(env):
    env = wrap_env(env, verbose=False)
    memory = RandomMemory(memory_size=STEPS + 1, num_envs=env.num_envs, device="cpu")
    agent = DQN(
        models={"q_network": Values(env), "target_q_network": Values(env)},
        memory=memory,
        cfg=DQN_CFG(learning_starts=1000, random_timesteps=1000),
        observation_space=env.observation_space,
        action_space=env.action_space,
        device="cpu",
    )
    SequentialTrainer(env=env, agents=agent, cfg=SequentialTrainerCfg(timesteps=STEPS, headless=True, disable_progressbar=True)).train()
    names = ("observations", "next_observations", "rewards", "terminated")
    return list(zip(*(memory.tensors[name][:STEPS, 0].flatten().tolist() for name in names), strict=True))


def jumps(rows):
    return [row for row in rows if row[1] != row[0] + 1]


single = recorded(gymnasium.make("Counting-v0"))
vector = recorded(gymnasium.make_vec("Counting-v0", num_envs=2, vectorization_mode="sync"))
print(f"skrl {version('skrl')}, Gymnasium {version('gymnasium')}: single environment, transitions across episodes: {jumps(single)}")
print(f"vector environment (observation, next, reward, terminated): {jumps(vector)}")
assert jumps(single) == []
assert jumps(vector) == [(105.0, 200.0, 0.0, False), (205.0, 300.0, 0.0, False)]
PYTHON

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q torch==2.13.0 skrl==2.1.1 gymnasium==1.4.0 numpy==2.4.6
cd "$folder"
venv/bin/python -W ignore record.py 2> log | grep -v 'skrl:' || { tail -5 log; exit 1; }
