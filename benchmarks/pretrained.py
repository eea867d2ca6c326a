"""Trains the models that the package ships, exports them into it, and measures them in validation sessions.

Training and rollouts run in a work folder and resume there; a change of observations or tasks needs a new work folder.
The models are chosen by validation figures: of a driver's best evaluation and its last step the one that does better in
the validation sessions, of a benchmark model the epoch with the lowest validation loss. The validation sessions have a
seed that no test uses.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import torch
import typer
from safetensors import safe_open

from dorothie_gym import __version__
from dorothie_gym.baselines.checkpoints import KIND, ModelCard
from dorothie_gym.baselines.experiment import RESULT_FILE
from dorothie_gym.baselines.rl.checkpoint import TENSORS, load_model, save_model
from dorothie_gym.baselines.rl.run import BEST, PROGRESS
from dorothie_gym.baselines.roles.co_wizard.files import FILES as CO_WIZARD_FILES
from dorothie_gym.baselines.roles.participant.files import FILES as PARTICIPANT_FILES
from dorothie_gym.evaluation.closed_loop import RolloutResult, RolloutSettings, parse_towns, roll_out
from dorothie_gym.evaluation.closed_loop.running import command_of
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player, find_player
from dorothie_gym.policies.navigation import FIELDS
from dorothie_gym.policies.policy import DESCRIPTION
from dorothie_gym.policies.pretrained import CARD_FILE, PREFIX, SHIPPED, CardFigure, PretrainedCard
from dorothie_gym.session.config import EnvConfig

SEED: Final = 0
"""Seed of every training."""

GENERATE: Final = "generate --sessions 183 --seed 77 --out corpus"

GENERATE_TALKS: Final = "generate --sessions 160 --seed 2300 --out talks"
"""Corpus of the learned Co-Wizard."""

_DRIVER: Final = (
    "train-rl {algorithm} --out {algorithm} --warm-start corpus --steps 1000000 --workers 0 --evaluate-every 100000 "
    f"--episodes 50 --seed {SEED} --set town=midtown --set guidance=goals --set exceptions=2"
)
_READER: Final = "train {row} --corpus corpus --encoder hashing --seeds 1 --workers 1 --out models"

VALIDATION_SEED: Final = 1
"""Seed of the validation rollouts; the leaderboard has 0."""

VALIDATION_SESSIONS: Final = 20

FIGURES: Final = ("success", "goal_condition_success", "route_completion", "driving_score")
"""Metrics of the rollouts that a card has."""

CHECKED: Final = EnvConfig(max_seconds=60.0)
"""Settings of the sessions in which an exported model is compared with the trained one."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Training of a shipped model: the commands, the folders of the results within the work folder, and the role."""

    description: str
    commands: tuple[str, ...]
    folders: tuple[str, ...]
    role: Role = Role.CO_WIZARD


RECIPES: Final[Mapping[str, Recipe]] = {
    "co-wizard": Recipe(
        description="A network decides memory, goal, commands and remarks; rules read, plan, answer and word",
        commands=(GENERATE_TALKS, "train co-wizard --corpus talks --workers 2 --out models"),
        folders=(f"models/co-wizard/seed-{SEED}",),
    ),
    "participant": Recipe(
        description="A network decides errand, guidance and remarks; rules read, plan and word",
        commands=(GENERATE_TALKS, "train participant --corpus talks --workers 2 --out models"),
        folders=(f"models/participant/seed-{SEED}",),
        role=Role.PARTICIPANT,
    ),
    "maskable-ppo": Recipe(
        description="MaskablePPO drives; understanding and speech are scripted",
        commands=(GENERATE, _DRIVER.format(algorithm="maskable_ppo")),
        folders=("maskable_ppo", f"maskable_ppo/{BEST}"),
    ),
    "ppo": Recipe(
        description="PPO drives; understanding and speech are scripted",
        commands=(GENERATE, _DRIVER.format(algorithm="ppo")),
        folders=("ppo", f"ppo/{BEST}"),
    ),
    "reader": Recipe(
        description="The Junction Reader chooses acts and turns; rules choose their times and word them",
        commands=(GENERATE, _READER.format(row="reader")),
        folders=(f"models/reader/small/seed-{SEED}",),
    ),
    "toto": Recipe(
        description="TOTO (small) chooses acts and turns; rules choose their times and word them",
        commands=(GENERATE, _READER.format(row="toto")),
        folders=(f"models/toto/small/seed-{SEED}",),
    ),
}
"""Shipped models by name."""


def main(
    names: Annotated[list[str] | None, typer.Argument(help="names of models; by default all")] = None,
    work: Annotated[Path, typer.Option(help="folder of corpus, trainings and rollouts")] = Path("runs/pretrained"),
) -> None:
    """Makes shipped models; all take about two hours of processor time."""
    torch.set_num_threads(1)
    chosen = names or list(RECIPES)
    unknown = [name for name in chosen if name not in RECIPES]
    if unknown:
        raise SystemExit(f"there is no model {unknown[0]!r}; choose from {', '.join(RECIPES)}")
    work.mkdir(parents=True, exist_ok=True)
    work = work.resolve()  # rollouts keep the paths of their models
    for name in chosen:
        recipe = RECIPES[name]
        for command in recipe.commands:
            _call(command, work)
        card = _export(name, recipe, work, *_choose(recipe, work))
        mean, low, high = (100 * value for value in asdict(card.figures["success"]).values())
        print(f"{PREFIX}{name}: success {mean:.0f} % ({low:.0f} to {high:.0f})", flush=True)


def _call(command: str, work: Path) -> None:
    """Runs a command of dorothie-gym in the work folder; finished work is not done again."""
    print(f"dorothie-gym {command}", flush=True)
    subprocess.run([sys.executable, "-m", "dorothie_gym", *command.split()], cwd=work, check=True)


def _choose(recipe: Recipe, work: Path) -> tuple[Path, RolloutResult]:
    """Plays the validation sessions with each result of a training; returns the best one, and its sessions."""
    players = [find_player(str(work / folder), recipe.role) for folder in recipe.folders]
    different = {player.sha256: player for player in reversed(players)}  # the best evaluation can be the last step
    found = [(Path(player.name), _validate(player, recipe.role, work / "validation")) for player in different.values()]
    for folder, result in found:
        print(
            f"{folder}: {', '.join(f'{key} {figure.mean:.3f}' for key, figure in _figures(result).items())}", flush=True
        )
    return max(found, key=lambda pair: [figure.mean for figure in _figures(pair[1]).values()])


def _export(name: str, recipe: Recipe, work: Path, trained: Path, result: RolloutResult) -> PretrainedCard:
    """Writes a trained model into the package, without the state of its optimiser, with the figures of its sessions."""
    shipped = SHIPPED / name
    shutil.rmtree(shipped, ignore_errors=True)
    shipped.mkdir(parents=True)
    page = json.loads((trained / DESCRIPTION).read_text(encoding="utf-8"))
    export = _EXPORTS.get(page["kind"], _export_driver)
    scores = export(trained, shipped)
    _check_same_actions(trained, shipped, recipe.role, work / "checks" / name)
    card = PretrainedCard(
        description=recipe.description,
        commands=tuple(f"dorothie-gym {command}" for command in recipe.commands),
        version=__version__,
        licence="MIT",
        seed=SEED,
        steps=page["steps"],
        seconds=page["seconds"],
        weights=_count_weights(shipped),
        observation=dict(FIELDS) if export is _export_driver else None,
        rollout=command_of({**result.settings, str(recipe.role): f"{PREFIX}{name}"}),
        sessions=VALIDATION_SESSIONS,
        figures=_figures(result),
        scores=scores,
        role=recipe.role.value,
    )
    (shipped / CARD_FILE).write_text(json.dumps(asdict(card), indent=1) + "\n", encoding="utf-8")
    return card


def _figures(result: RolloutResult) -> dict[str, CardFigure]:
    found: dict[str, CardFigure] = {}
    for key in FIGURES:
        each = result.figures()[key]
        assert each.mean is not None and each.low is not None and each.high is not None  # there are sessions
        found[key] = CardFigure(mean=round(each.mean, 4), low=round(each.low, 4), high=round(each.high, 4))
    return found


def _export_driver(trained: Path, shipped: Path) -> dict[str, float | None]:
    """Writes a driver; returns the figures of its evaluation during the training."""
    model, settings = load_model(trained)
    model.policy.optimizer.state.clear()
    page = json.loads((trained / DESCRIPTION).read_text(encoding="utf-8"))
    save_model(model, settings, shipped, page["seconds"])
    (shipped / TENSORS).chmod(0o644)
    run = trained.parent if trained.name == BEST else trained
    rows = [json.loads(line) for line in (run / PROGRESS).read_text(encoding="utf-8").splitlines()]
    row = next(row for row in rows if row["steps"] == page["steps"])
    return {key: value for key, value in row.items() if key not in ("steps", "seconds")}


def _export_benchmark_model(trained: Path, shipped: Path) -> dict[str, float | None]:
    """Writes a benchmark model; returns its metrics on the validation points."""
    card = ModelCard.read(trained)
    shutil.copyfile(trained / card.weights, shipped / card.weights)
    card.write(shipped)
    scores: dict[str, float | None] = json.loads((trained / RESULT_FILE).read_text(encoding="utf-8"))["validation"]
    return scores


def _export_role(trained: Path, shipped: Path) -> dict[str, float | None]:
    """Writes a learned Co-Wizard or participant; its training has no validation."""
    for name in (DESCRIPTION, TENSORS):
        shutil.copyfile(trained / name, shipped / name)
    return {}


_EXPORTS: Final[Mapping[str, Callable[[Path, Path], dict[str, float | None]]]] = {
    KIND: _export_benchmark_model,
    CO_WIZARD_FILES.kind: _export_role,
    PARTICIPANT_FILES.kind: _export_role,
}
"""Functions that write models into the package, by kind; all others are drivers."""


def _check_same_actions(trained: Path, shipped: Path, role: Role, folder: Path) -> None:
    """Plays two sessions with the trained model and with the exported one, whose actions must be equal."""
    found = []
    for model in (trained, shipped):
        shutil.rmtree(folder, ignore_errors=True)
        settings = _rollout_settings(find_player(str(model), role), role, 2, CHECKED)
        roll_out(settings, folder)
        found.append([(folder / plan.path / "actions.jsonl").read_bytes() for plan in settings.plans()])
    if found[0] != found[1]:
        raise SystemExit(f"{shipped} acts otherwise than {trained}")


def _validate(player: Player, role: Role, folder: Path) -> RolloutResult:
    """Plays the validation sessions, or reads those that the same weights have played."""
    assert player.sha256 is not None
    return roll_out(_rollout_settings(player, role, VALIDATION_SESSIONS), folder / player.sha256[:12])


def _rollout_settings(player: Player, role: Role, sessions: int, config: EnvConfig | None = None) -> RolloutSettings:
    return RolloutSettings(
        cast={**ALL_SCRIPTED, role: player},
        towns=parse_towns("seen"),
        sessions=sessions,
        seed=VALIDATION_SEED,
        config=config or EnvConfig(),
    )


def _count_weights(folder: Path) -> int:
    total = 0
    for path in folder.glob("*.safetensors"):
        with safe_open(path, framework="pt") as file:
            tensors: Any = file
            total += sum(tensors.get_tensor(name).numel() for name in tensors.keys())  # noqa: SIM118  # a handle, not a dict
    return total


if __name__ == "__main__":
    typer.run(main)
