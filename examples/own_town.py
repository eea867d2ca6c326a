"""Builds a town from a YAML file, checks it, and drives in it.

The town is a village with five streets and one traffic light (`docs/towns.md` describes the format). The script writes
`mill_end.yaml` into a folder, reports its size and any faults, draws its map, and plays a session with scripted
policies. It takes about ten seconds.

    python examples/own_town.py --out mill_end
    dorothie-gym run --town mill_end/mill_end.yaml     # the same town, with the conversation on the screen
"""

from __future__ import annotations

import argparse
from pathlib import Path

from dorothie_gym import DuoWizardEnv, EnvConfig, make_policy
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import describe, load_town
from dorothie_gym.maps.lint import check_town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.pictures import town_picture

TOWN = """\
name: mill_end
junctions:
  church: [0, 0]
  mill: [180, 0]
  forge: [180, 180]
  pond: [0, 180]
streets:
  High Street: [church, mill]
  Mill Lane: [mill, forge]
  Pond Road: [forge, pond]
  Green Lane: [pond, [-15, 90], church]
  Short Cut: {through: [church, forge], speed: 30}
lights: [church]
crosswalks:
  - [mill, High Street]
"""


def main() -> None:
    """Writes, checks, draws and drives the town."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("mill_end"), help="folder for the town, its map and a session")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=300.0, help="longest session [simulated seconds]")
    options = parser.parse_args()

    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "mill_end.yaml"
    file.write_text(TOWN, encoding="utf-8")
    town = load_town(file)
    facts = describe(town)
    print(f"{facts['lanes']} lanes, {facts['junctions']} junctions, {facts['sites']} sites for landmarks")
    for fault in check_town(town):
        print(f"fault: {fault.message}")
    town_picture(town, options.out / "mill_end.png")

    env = DuoWizardEnv(file, config=EnvConfig(max_seconds=options.seconds))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    summary = play_session(env, policies, seed=options.seed)
    print(f"success: {summary['success']} ({summary['reason']})")


if __name__ == "__main__":
    main()
