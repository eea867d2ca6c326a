"""Defines a Co-Wizard policy of our own and compares it with two policies of the package in closed loop.

A policy is stateless: `initial_state(seed, town)` and `step(observation, state) -> (action, state)`. The example policy
delegates everything to the scripted Co-Wizard but never changes the cruise speed, and leaves out physical actions that
the car would refuse; for this it reads the action mask, which its observation contains because of `reads_mask`.
Sessions are recorded and measured with the metrics of `docs/closed-loop.md`.
Three policies with two sessions each take about 20 seconds.

    python examples/own_policy.py --sessions 2 --town brookside
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dorothie_gym import DuoWizardEnv, EnvConfig, Policy, Session, Town, make_policy
from dorothie_gym.evaluation.closed_loop import METRICS, measure
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction, Role
from dorothie_gym.session.spaces import SpaceLimits


class SteadySpeed(Policy[Any]):
    """Scripted Co-Wizard that keeps its cruise speed and commands nothing that the car would refuse."""

    reads_mask = True

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        super().__init__(Role.CO_WIZARD, limits)
        self._scripted = make_policy("scripted", Role.CO_WIZARD, limits)

    def initial_state(self, seed: int, town: Town) -> Any:
        """Returns the state of the scripted policy; there is nothing else to remember."""
        return self._scripted.initial_state(seed, town)

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[dict[str, Any], Any]:
        """Returns the scripted action without changes of speed and without infeasible physical actions."""
        action, state = self._scripted.step(observation, state)
        physical = action["physical"]
        if physical == PhysicalAction.SPEED_CHANGE or not observation["action_mask"]["physical"][physical]:
            action["physical"] = 0
        return action, state


def main() -> None:
    """Plays the same sessions with each policy and prints a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=600.0, help="longest session [simulated seconds]")
    parser.add_argument("--town", default="brookside", help="name or file of a town")
    options = parser.parse_args()

    env = DuoWizardEnv(options.town, config=EnvConfig(max_seconds=options.seconds))
    candidates = {
        "scripted": make_policy("scripted", Role.CO_WIZARD, env.limits),
        "lane-follow": make_policy("lane-follow", Role.CO_WIZARD, env.limits),
        "steady speed": SteadySpeed(env.limits),
    }
    shown = [metric for metric in METRICS if metric.key in ("success", "route_completion", "driving_score", "seconds")]
    print(f"{'':14}" + "".join(f"{metric.title:>16}" for metric in shown))
    for name, policy in candidates.items():
        policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
        records = []
        for seed in range(options.sessions):
            with tempfile.TemporaryDirectory() as folder:
                session = Path(folder) / "session"
                play_session(env, {**policies, Role.CO_WIZARD: policy}, seed=seed, folder=session)
                records.append(measure(Session.load(session), env.town))
        print(f"{name:14}" + "".join(f"{metric.of(records):16.2f}" for metric in shown))


if __name__ == "__main__":
    main()
