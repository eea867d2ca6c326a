"""Trains PPO's CnnPolicy of stable-baselines3 to drive by the pictures of the car's camera, some frames at a time.

The observations of Navigation-v0 are pictures of 84 x 84 pixels with a dashboard in the lowest rows, which shows the
instruction. They are drawn on threads, without a GPU. `VecFrameStack` gives the network the last frames together. The
default of 20,000 steps takes about four minutes on one idle core and shows no more than that it runs.
`dorothie-gym train-rl maskable_ppo --observation camera` adds action masks, tuned settings, checkpoints and resuming.

    python examples/rl_pictures.py --steps 20000 --frames 4

Needs the extra `dorothie-gym[baselines]`.
"""

from __future__ import annotations

import argparse

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecMonitor

import dorothie_gym  # noqa: F401 (registers the environments)
from dorothie_gym.wrappers import sb3_vec_env


def make(count: int, frames: int, max_seconds: float) -> VecEnv:
    """Returns some environments whose observations are the last frames (84, 84, 3 * frames)."""
    envs = gym.make_vec(
        "dorothie_gym/Navigation-v0",
        num_envs=count,
        observation="camera",
        max_seconds=max_seconds,
        autoreset_mode="SameStep",
    )
    return VecFrameStack(VecMonitor(sb3_vec_env(envs)), frames)


def main() -> None:
    """Trains and evaluates in rounds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=20_000, help="environment steps in total")
    parser.add_argument("--environments", type=int, default=8, help="parallel environments")
    parser.add_argument("--rollout", type=int, default=128, help="steps of each environment per update")
    parser.add_argument("--frames", type=int, default=4, help="frames that the network sees together")
    parser.add_argument("--rounds", type=int, default=5, help="evaluations during training")
    parser.add_argument("--max-seconds", type=float, default=300.0, help="simulated length of an episode")
    options = parser.parse_args()

    envs = make(options.environments, options.frames, options.max_seconds)
    test_envs = make(1, options.frames, options.max_seconds)
    model = PPO("CnnPolicy", envs, n_steps=options.rollout, batch_size=256, n_epochs=4, ent_coef=0.01, seed=0)
    for _ in range(options.rounds):
        model.learn(options.steps // options.rounds, reset_num_timesteps=False)
        mean_return, _ = evaluate_policy(model, test_envs, n_eval_episodes=3)
        print(f"{model.num_timesteps:>8,} steps: mean return {mean_return:7.2f}", flush=True)
    envs.close()
    test_envs.close()


if __name__ == "__main__":
    main()
