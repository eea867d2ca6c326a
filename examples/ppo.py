"""Trains a driver for Navigation-v0 by PPO with action masks, in one file with torch alone.

The vector environment plays all episodes in one call; networks, advantages and updates are written out below, to be
read and changed. Prints one line after each rollout. A million steps take about 90 s on two cores.

    python examples/ppo.py --seed 1 --until 0.8

Needs torch, which the extra `dorothie-gym[baselines]` brings.
"""

from __future__ import annotations

import argparse
import time
from collections import deque

import gymnasium as gym
import numpy as np
import torch
from torch import Tensor, nn

import dorothie_gym  # noqa: F401 (registers the environments)

GAMMA, LAMBDA = 0.99, 0.95
"""Discount of a decision, and of the advantages of later decisions (Schulman et al. 2016)."""

CLIP, EPOCHS, ENTROPY, MAX_GRADIENT = 0.2, 4, 0.005, 0.5
"""Clipping of the ratio, passes over a rollout, first weight of the entropy, and largest norm of a gradient."""


class Driver(nn.Module):
    """Actor and critic with two hidden layers each."""

    def __init__(self, inputs: int, actions: int, width: int = 64) -> None:
        super().__init__()
        self.actor = layers(inputs, width, actions, gain=0.01)
        self.critic = layers(inputs, width, 1, gain=1.0)

    def distribution(self, observations: Tensor, masks: Tensor) -> torch.distributions.Categorical:
        """Returns the distribution over the feasible actions."""
        logits = self.actor(observations).masked_fill(~masks, -1e8)
        return torch.distributions.Categorical(logits=logits, validate_args=False)

    def value(self, observations: Tensor) -> Tensor:
        """Returns the expected return (n,)."""
        return self.critic(observations).squeeze(-1)


def layers(inputs: int, width: int, outputs: int, gain: float) -> nn.Sequential:
    """Returns a network with orthogonal weights."""
    linears = [nn.Linear(inputs, width), nn.Linear(width, width), nn.Linear(width, outputs)]
    for linear, scale in zip(linears, (2**0.5, 2**0.5, gain), strict=True):
        nn.init.orthogonal_(linear.weight, scale)
        nn.init.zeros_(linear.bias)
    return nn.Sequential(linears[0], nn.Tanh(), linears[1], nn.Tanh(), linears[2])


def advantages_of(rewards: Tensor, values: Tensor, ends: Tensor, last: Tensor) -> Tensor:
    """Returns generalised advantages (steps, environments) of a rollout; an episode that ends adds none behind it."""
    advantages, running = torch.zeros_like(rewards), torch.zeros_like(last)
    following = last
    for t in reversed(range(len(rewards))):
        error = rewards[t] + GAMMA * following * ~ends[t] - values[t]
        running = error + GAMMA * LAMBDA * running * ~ends[t]
        advantages[t], following = running, values[t]
    return advantages


def main() -> None:
    """Trains until the steps are done or the success rate is reached."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--environments", type=int, default=256)
    parser.add_argument("--rollout", type=int, default=32, help="decisions of each environment between two updates")
    parser.add_argument("--steps", type=int, default=1_000_000, help="decisions of all environments together")
    parser.add_argument("--batch", type=int, default=1024)
    parser.add_argument("--rate", type=float, default=1e-3, help="learning rate, which falls linearly to 0")
    parser.add_argument("--until", type=float, default=1.1, help="success rate of the last 200 episodes that suffices")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", default="cpu")
    arguments = parser.parse_args()
    torch.manual_seed(arguments.seed)
    torch.set_num_threads(1)  # of small networks, more would only wait
    count, steps, device = arguments.environments, arguments.rollout, arguments.device
    envs = gym.make_vec("dorothie_gym/Navigation-v0", num_envs=count, autoreset_mode="SameStep")
    inputs, actions = envs.single_observation_space.shape[0], int(envs.single_action_space.n)
    driver = Driver(inputs, actions).to(device)
    optimiser = torch.optim.Adam(driver.parameters(), lr=arguments.rate, eps=1e-5, fused=True)
    rollouts = arguments.steps // (count * steps)
    observations = torch.zeros(steps, count, inputs, device=device)
    masks = torch.zeros(steps, count, actions, dtype=torch.bool, device=device)
    chosen = torch.zeros(steps, count, dtype=torch.long, device=device)
    chances, values, rewards = (torch.zeros(steps, count, device=device) for _ in range(3))
    ends = torch.zeros(steps, count, dtype=torch.bool, device=device)
    successes: deque[bool] = deque(maxlen=200)

    observation, infos = envs.reset(seed=arguments.seed * count)
    since, acting = time.perf_counter(), 0.0
    for rollout in range(rollouts):
        left = 1.0 - rollout / rollouts
        optimiser.param_groups[0]["lr"] = arguments.rate * left
        begun = time.perf_counter()
        for t in range(steps):
            observations[t] = torch.from_numpy(observation)
            masks[t] = torch.from_numpy(infos["action_mask"].astype(bool))
            with torch.no_grad():
                distribution = driver.distribution(observations[t], masks[t])
                chosen[t] = distribution.sample()
                chances[t], values[t] = distribution.log_prob(chosen[t]), driver.value(observations[t])
            observation, reward, terminated, truncated, infos = envs.step(chosen[t].cpu().numpy())
            ends[t] = torch.from_numpy(terminated | truncated)
            if truncated.any():  # a time limit is no end of the world: what would have followed counts
                final = torch.from_numpy(np.stack(infos["final_obs"][truncated])).to(device)
                with torch.no_grad():
                    reward[truncated] += GAMMA * driver.value(final).cpu().numpy()
            rewards[t] = torch.from_numpy(reward.astype(np.float32))
            if "final_info" in infos:
                successes.extend(infos["final_info"]["is_success"][terminated | truncated].tolist())
        acting += time.perf_counter() - begun

        with torch.no_grad():
            advantages = advantages_of(rewards, values, ends, driver.value(torch.from_numpy(observation).to(device)))
        returns = (advantages + values).flatten()
        data = [each.flatten(0, 1) for each in (observations, masks, chosen, chances, advantages)]
        for _ in range(EPOCHS):
            for rows in torch.randperm(count * steps, device=device).split(arguments.batch):
                seen, mask, action, chance, advantage = (each[rows] for each in data)
                distribution = driver.distribution(seen, mask)
                ratio = (distribution.log_prob(action) - chance).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.min(ratio * advantage, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * advantage).mean()
                error = (driver.value(seen) - returns[rows]).square().mean()
                loss = 0.5 * error - gain - ENTROPY * left * distribution.entropy().mean()
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(driver.parameters(), MAX_GRADIENT)
                optimiser.step()

        done, spent = (rollout + 1) * count * steps, time.perf_counter() - since
        success = float(np.mean(successes)) if successes else 0.0
        print(
            f"{done:9,} steps  {spent:6.1f} s  {done / spent:7,.0f} steps/s ({acting / spent:3.0%} acting)  "
            f"success {success:4.0%} of {len(successes)} episodes  return {float(returns.mean()):6.2f}",
            flush=True,
        )
        if len(successes) == successes.maxlen and success >= arguments.until:
            break


if __name__ == "__main__":
    main()
