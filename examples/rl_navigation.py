"""Trains MaskablePPO of sb3-contrib on Navigation-v0 and prints the learning progress.

Navigation-v0 reduces the Co-Wizard's role to driving with given instructions. The script alternates training and
evaluation on held-out seeds. The default of 20,000 steps takes about two minutes on one idle core and is enough to see
the return change. Success rates above 80 % need about 200,000 steps and the settings of `dorothie-gym train-rl
maskable_ppo`, which adds parallel workers, checkpoints and resuming.

    python examples/rl_navigation.py --steps 20000 --save model.zip

Needs the extra `dorothie-gym[baselines]`.
"""

from __future__ import annotations

import argparse

import gymnasium as gym
import numpy as np
from sb3_contrib import MaskablePPO

import dorothie_gym  # noqa: F401 (registers the environments)


def evaluate(model: MaskablePPO, env: gym.Env, episodes: int) -> tuple[float, float]:
    """Returns the share of successful episodes and the mean return, over seeds that training does not use."""
    successes, returns = [], []
    for episode in range(episodes):
        observation, info = env.reset(seed=1_000_000 + episode)
        done, total = False, 0.0
        while not done:
            action, _ = model.predict(observation, action_masks=info["action_mask"], deterministic=True)
            observation, reward, terminated, truncated, info = env.step(int(action))
            done, total = terminated or truncated, total + float(reward)
        successes.append(info["is_success"])
        returns.append(total)
    return float(np.mean(successes)), float(np.mean(returns))


def main() -> None:
    """Trains and evaluates in rounds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=20_000, help="environment steps in total")
    parser.add_argument("--rounds", type=int, default=5, help="evaluations during training")
    parser.add_argument("--episodes", type=int, default=5, help="episodes per evaluation")
    parser.add_argument("--rollout", type=int, default=1024, help="steps per update")
    parser.add_argument("--max-seconds", type=float, default=300.0, help="simulated length of an episode")
    parser.add_argument("--town", default="millbrook", help="name or file of a town")
    parser.add_argument("--save", help="file for the trained model")
    options = parser.parse_args()

    settings = {"town": options.town, "guidance": "turns", "traffic": "light", "max_seconds": options.max_seconds}
    env = gym.make("dorothie_gym/Navigation-v0", **settings)
    test_env = gym.make("dorothie_gym/Navigation-v0", **settings)
    parameters = {"learning_rate": 1e-3, "n_epochs": 8, "gamma": 0.98, "ent_coef": 0.005}
    batch = min(256, options.rollout)
    model = MaskablePPO("MlpPolicy", env, n_steps=options.rollout, batch_size=batch, seed=0, **parameters)
    for _ in range(options.rounds):
        model.learn(options.steps // options.rounds, reset_num_timesteps=False)
        success, mean_return = evaluate(model, test_env, options.episodes)
        print(f"{model.num_timesteps:>8,} steps: success {success:4.0%}, mean return {mean_return:7.2f}", flush=True)
    if options.save:
        model.save(options.save)


if __name__ == "__main__":
    main()
