#!/usr/bin/env bash
# highway-env 1.12.1 (Gymnasium 1.4.0): frequencies that do not divide make the world slower than the clock, down to standstill.
#
# Guess before: an environment with 15 substeps and 4 decisions a second simulates a quarter of a second in each decision,
# perhaps with three and four substeps in turn; what is impossible is refused.
# Seen: each decision has the whole part of 15 / 4, that is 3 substeps, 0.2 s. The clock, which ends the episode, and the
# rewards count it as 0.25 s, and nothing warns. At 25 m/s in episodes of 4 s by that clock:
# - 15 and 5 Hz, which divide: 100 m; 15 and 4 Hz: 80 m; 15 and 8 Hz: 53 m, little more than half;
# - 15 and 20 Hz: no car moves at all;
# - 15 and 0.1 Hz, of which one is 150 times the other: 149 substeps in floating point, so that the car goes 248.3 m, not 250.
# Speeds that an agent sees, and distances that it covers between decisions, do not match.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export HOME="$folder" SDL_VIDEODRIVER=dummy
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q highway-env==1.12.1 gymnasium==1.4.0 numpy==2.4.6
cd "$folder"

cat > drive.py <<'PYTHON'
import gymnasium
import highway_env
import numpy as np

gymnasium.register_envs(highway_env)
SPEED = 25.0


def driven(simulation, policy, seconds):
    """Returns the metres driven in a straight line without acceleration, until the environment says that time is up."""
    settings = {"simulation_frequency": simulation, "policy_frequency": policy, "duration": seconds, "vehicles_count": 0}
    env = gymnasium.make("highway-v0", config={**settings, "action": {"type": "ContinuousAction"}})
    env.reset(seed=0)
    car, decisions, truncated = env.unwrapped.vehicle, 0, False
    start = car.position[0]
    assert car.speed == SPEED
    while not truncated:
        _, _, terminated, truncated, _ = env.step(np.zeros(2, np.float32))
        assert not terminated and car.speed == SPEED
        decisions += 1
    metres = float(car.position[0] - start)
    print(f"{simulation} substeps and {policy} decisions a second: {decisions} decisions, {env.unwrapped.time:.1f} s, "
          f"{metres:.1f} m at {SPEED:g} m/s, which take {metres / SPEED:.2f} s")
    return round(metres, 1)


assert driven(15, 5, 4) == 100.0
assert driven(15, 4, 4) == 80.0
assert driven(15, 8, 4) == 53.3
assert driven(15, 20, 4) == 0.0
assert driven(15, 0.1, 10) == 248.3
PYTHON
venv/bin/python -W ignore drive.py
