"""Trains a Co-Wizard with MaskablePPO on macro-actions, and draws its learning curve.

The agent hears what the participant says (dialogue acts), and chooses when to listen and where to drive: to one of ten
places, or to the place that was mentioned last. Sessions of 120 s in the empty village of brookside with a quiet
participant have about six actions each. Training takes about four minutes on one core. Needs the extra `baselines`.

    python examples/rl_co_wizard.py --out co_wizard.zip
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np
from gymnasium.wrappers import FilterObservation
from sb3_contrib import MaskablePPO
from stable_baselines3.common.monitor import Monitor

import dorothie_gym
from dorothie_gym import EnvConfig, MacroActions, RewardWeights, WorldConfig

FIELDS = ["heard", "heard_moves", "goal", "arrived", "motion"]
"""What the agent observes: words that were heard, and what the car does."""


def make_env(town: str, seconds: float) -> Monitor:
    """Returns `CoWizard-v0` with macro-actions, and some fields of the observation as one normalised vector."""
    env = gym.make(
        "dorothie_gym/CoWizard-v0",
        town=town,
        config=EnvConfig(
            decision_frequency=1.0,
            max_seconds=seconds,
            world=WorldConfig(vehicles=0, pedestrians=0),
            rewards=RewardWeights(success=1.0),
        ),
        partners={"participant": "scripted:talkativeness=0..0.2", "ad_wizard": "silent"},
    )
    env = MacroActions(env, seconds=30.0, kinds={"goal"})
    return Monitor(dorothie_gym.flatten(FilterObservation(env, FIELDS), box=True))


def draw_curve(returns: Sequence[float], path: Path) -> None:
    """Draws the returns of the training episodes, and their mean over 30 episodes."""
    window = max(1, min(30, len(returns) // 4))
    mean = np.convolve(returns, np.ones(window) / window, mode="valid")
    figure, axes = plt.subplots(figsize=(6.4, 3.6))
    axes.plot(np.arange(1, len(returns) + 1), returns, ".", ms=3, alpha=0.35, label="one episode")
    axes.plot(np.arange(window, len(returns) + 1), mean, lw=2, label=f"mean of {window} episodes")
    axes.set(xlabel="episode", ylabel="return", title="MaskablePPO with macro-actions on CoWizard-v0")
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=110, bbox_inches="tight")


def main() -> None:
    """Trains, saves the model, and draws the curve beside it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=10_000, help="macro-actions")
    parser.add_argument("--rollout", type=int, default=256, help="macro-actions between two updates")
    parser.add_argument("--town", default="brookside", help="name or file of a town")
    parser.add_argument("--seconds", type=float, default=120.0, help="longest session [simulated seconds]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("co_wizard.zip"))
    options = parser.parse_args()

    env = make_env(options.town, options.seconds)
    settings = {"gamma": 0.9, "gae_lambda": 0.95, "ent_coef": 0.005, "learning_rate": 2e-3, "seed": options.seed}
    model = MaskablePPO("MlpPolicy", env, n_steps=options.rollout, batch_size=64, device="cpu", **settings)
    model.learn(total_timesteps=options.steps)
    model.save(options.out)
    returns = env.get_episode_rewards()
    draw_curve(returns, options.out.with_suffix(".png"))
    tenth = max(1, len(returns) // 10)
    first, last = np.mean(returns[:tenth]), np.mean(returns[-tenth:])
    print(f"{len(returns)} episodes; mean return {first:.2f} in the first tenth, {last:.2f} in the last")


if __name__ == "__main__":
    main()
