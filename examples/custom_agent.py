"""Plays the Co-Wizard with an agent of our own, in a plain loop over `gym.make("dorothie_gym/CoWizard-v0")`.

The agent asks for directions, turns at junctions when the participant mentions a direction, and goes straight on
otherwise. It is a starting point, not a good driver. Scripted policies play the participant and the Ad-Wizard. The
script prints the conversation and the outcome; a session of five simulated minutes takes about five seconds.

    python examples/custom_agent.py --town brookside --seed 7
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium as gym
import numpy as np

import dorothie_gym  # noqa: F401 (registers the environments)
from dorothie_gym.ontology import DialogueAct, DialogueMove, PhysicalAction
from dorothie_gym.session.spaces import CoWizardAction, ExitColumn, Physical, SpaceLimits, Speech
from dorothie_gym.sim.state.codes import Motion

DIRECTIONS = {"left": 90.0, "right": -90.0, "straight": 0.0}
"""Angles of the directions that the agent understands [degrees, positive left]."""


class KeywordAgent:
    """Understands the words in `DIRECTIONS` and takes the exit that fits the last one."""

    def __init__(self) -> None:
        self.wanted = 0.0

    def act(self, observation: dict[str, Any]) -> CoWizardAction:
        """Returns the next action of the Co-Wizard."""
        heard = str(observation["participant_text"]).lower()
        mentioned = [(heard.rfind(word), angle) for word, angle in DIRECTIONS.items() if word in heard]
        if mentioned:
            self.wanted = max(mentioned)[1]  # the last direction in the utterance
        speech = Speech(act=DialogueAct.of(DialogueMove.ACKNOWLEDGE), text="Okay.") if heard else None
        return CoWizardAction(speech=speech, physical=self.drive(observation))

    def drive(self, observation: dict[str, Any]) -> Physical | None:
        """Returns a driving action where the car needs one: it stands, or waits for a choice of exit."""
        motion = Motion(int(observation["motion"]))
        if motion is Motion.STOPPED:
            return Physical(action=PhysicalAction.START)
        if motion is not Motion.WAITING:
            return None
        exits = observation["exits"]
        angles = exits[exits[:, ExitColumn.PRESENT] > 0.0][:, ExitColumn.ANGLE]
        if len(angles) == 0:
            return Physical(action=PhysicalAction.U_TURN)
        nearest = angles[np.argmin(np.abs(angles - self.wanted))]
        self.wanted = 0.0
        return Physical(action=PhysicalAction.J_TURN, angle=int(nearest))


def main() -> None:
    """Plays one session."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--town", default="brookside", help="name or file of a town")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--decisions", type=int, default=600, help="longest session, at two decisions per second")
    options = parser.parse_args()

    env = gym.make("dorothie_gym/CoWizard-v0", town=options.town, max_cycles=options.decisions)
    observation, info = env.reset(seed=options.seed)
    agent, limits, total, done = KeywordAgent(), SpaceLimits(), 0.0, False
    while not done:
        if observation["participant_text"]:
            print(f"{float(observation['time'][0]):6.1f} s  participant: {observation['participant_text']}")
        observation, reward, terminated, truncated, info = env.step(agent.act(observation).encode(limits))
        total, done = total + float(reward), terminated or truncated
    print(f"return {total:.2f}; reward terms of the last decision: {info['reward_terms']}")


if __name__ == "__main__":
    main()
