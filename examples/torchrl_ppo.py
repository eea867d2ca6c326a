"""Trains a driver for Navigation-v0 with TorchRL's PPO on the vector environment.

The batch of environments is one environment of TorchRL; those that are over are reset by TorchRL, which asks for the
autoreset mode "Disabled". The default of 65,536 steps takes about one minute on two cores.

    python examples/torchrl_ppo.py --steps 65536

Needs `pip install torchrl` besides the extra `dorothie-gym[baselines]`.
"""

from __future__ import annotations

import argparse

import gymnasium as gym
import torch
from tensordict.nn import TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import dorothie_gym  # noqa: F401 (registers the environments)


def network(inputs: int, outputs: int) -> nn.Sequential:
    """Returns a network with two hidden layers."""
    return nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs))


def main() -> None:
    """Trains, and prints the mean reward of each rollout."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--environments", type=int, default=64)
    parser.add_argument("--steps", type=int, default=65_536)
    parser.add_argument("--rollout", type=int, default=4096, help="steps of all environments between two updates")
    arguments = parser.parse_args()
    envs = gym.make_vec("dorothie_gym/Navigation-v0", num_envs=arguments.environments, autoreset_mode="Disabled")
    inputs, actions = envs.single_observation_space.shape[0], int(envs.single_action_space.n)
    env = GymWrapper(envs, categorical_action_encoding=True)
    logits = TensorDictModule(network(inputs, actions), in_keys=["observation"], out_keys=["logits"])
    actor = ProbabilisticActor(
        logits, in_keys=["logits"], distribution_class=torch.distributions.Categorical, return_log_prob=True
    )
    critic = ValueOperator(network(inputs, 1), in_keys=["observation"])
    advantage = GAE(gamma=0.98, lmbda=0.95, value_network=critic, average_gae=True)
    loss = ClipPPOLoss(actor, critic, entropy_coeff=0.005)
    optimiser = torch.optim.Adam(loss.parameters(), lr=1e-3)
    collector = Collector(env, actor, frames_per_batch=arguments.rollout, total_frames=arguments.steps)
    done = 0
    for rollout in collector:
        for _ in range(4):
            advantage(rollout)
            rows = rollout.reshape(-1)
            for part in rows[torch.randperm(len(rows))].split(1024):
                losses = loss(part)
                optimiser.zero_grad()
                sum(losses[name] for name in ("loss_objective", "loss_critic", "loss_entropy")).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimiser.step()
        done += rollout.numel()
        print(f"{done:8,} steps: mean reward {rollout['next', 'reward'].mean().item():7.4f}", flush=True)
    collector.shutdown()


if __name__ == "__main__":
    main()
