"""Replaces one part of the learned Co-Wizard at a time, and plays the same sessions with the rest.

Each row is a rollout with its own folder in the work folder, and resumes there. The sessions are those of
`dorothie-gym rollout` with the same towns, number and seed. The weights are not fitted again: a row shows the trained
network without a part, not the result of training without that part.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from dorothie_gym.baselines.roles.co_wizard.decision import CoWizardPercept
from dorothie_gym.baselines.roles.co_wizard.features import ordered_exit
from dorothie_gym.baselines.roles.co_wizard.files import FILES
from dorothie_gym.baselines.roles.co_wizard.memory import FRESH, SPEEDS, Update, WorkingMemory
from dorothie_gym.baselines.roles.co_wizard.network import HeardNumbers
from dorothie_gym.baselines.roles.co_wizard.policy import LearnedCoWizard, LearnedDecision, LearnedState
from dorothie_gym.baselines.roles.learned_role.inference import MISSING
from dorothie_gym.baselines.roles.learned_role.policy import drawn
from dorothie_gym.baselines.roles.learned_role.remark_forms import Sources, filled
from dorothie_gym.cli.output import reporting_errors, session_progress
from dorothie_gym.evaluation.closed_loop import RolloutResult, RolloutSettings, parse_towns, roll_out
from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.policies import ALL_SCRIPTED, Player, find_player, pretrained_folder
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.language_model.co_wizard_prompt import drive_options
from dorothie_gym.policies.language_model.navigator import Navigator
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.pretrained import is_pretrained
from dorothie_gym.policies.speech import Remark
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import ObservationMapping, Physical, SpaceLimits
from dorothie_gym.sim.state.codes import Motion

SHOWN: Final = ("success", "driving_score", "goal_condition_success", "exchanges_per_subgoal", "seconds")
"""Metrics of the printed table."""


class RandomCommands(LearnedCoWizard):
    """Commands that are drawn evenly among those that the action mask allows, "none" among them."""

    def _command(
        self, percept: CoWizardPercept, memory: WorkingMemory, rng: np.random.Generator, scores: NDArray[np.float32]
    ) -> int:
        return int(rng.integers(int((scores > MISSING).sum())))


class RuledCommands(LearnedCoWizard):
    """Commands by a rule over the memory that the network has written."""

    def _command(
        self, percept: CoWizardPercept, memory: WorkingMemory, rng: np.random.Generator, scores: NDArray[np.float32]
    ) -> int:
        return ruled_command(memory, percept.view)


def ruled_command(memory: WorkingMemory, view: CoWizardView) -> int:
    """Returns the index of the first allowed command among: stop, requested action, route, driving on, speed, lights.

    Args:
        memory: working memory after listening.
        view: observation.
    """
    step = memory.navigator.step(memory.town, view, memory.clock.interval, 0.0)
    due = None if step is None or not step.due else Physical(action=step.action, angle=step.angle)
    way = ordered_exit(memory, view, junction_meant(memory.town, view.here, view.choice))
    halts, goes = bool(memory.value("halted")), view.motion is not Motion.STOPPED
    faster, lights = SPEEDS[memory.value("speed")] - view.cruise, memory.value("lights")
    prepared = view.manoeuvre is PhysicalAction.J_TURN and way is not None and abs(view.angle - way.angle) < 1.0
    wanted: list[tuple[bool, Physical]] = [
        (halts and goes, Physical(action=PhysicalAction.STOP)),
        (memory.value("manoeuvre") == 1, Physical(action=PhysicalAction.U_TURN)),
        (memory.value("manoeuvre") == 2, Physical(action=PhysicalAction.LANE_SWITCH, angle=90)),
        (memory.value("manoeuvre") == 3, Physical(action=PhysicalAction.LANE_SWITCH, angle=-90)),
        (
            way is not None and not prepared and not memory.value("skip"),
            Physical(action=PhysicalAction.J_TURN, angle=0 if way is None else way.angle),
        ),
        (due is not None and way is None, due or Physical(action=PhysicalAction.STOP)),
        (not halts and not goes, Physical(action=PhysicalAction.START)),
        (abs(faster) > 2.5, Physical(action=PhysicalAction.SPEED_CHANGE, up=faster > 0)),
        (lights > 0 and view.lights is not (lights == 1), Physical(action=PhysicalAction.LIGHT_CHANGE, up=lights == 1)),
    ]
    options = list(drive_options(view, memory.town).values())
    chosen = [options.index(command) for holds, command in wanted if holds and command in options]
    return chosen[0] if chosen else options.index(None)


class FrozenListening(LearnedCoWizard):
    """Nothing that is heard changes the memory: it keeps its initial values, and no goal is set."""

    def _updates(
        self, percepts: Sequence[CoWizardPercept], rows: Sequence[Sequence[int]], heard: HeardNumbers
    ) -> list[Update]:
        return [Update(values=percept.memory.values, fresh=(False,) * len(FRESH)) for percept in percepts]


class WithoutRoute(LearnedCoWizard):
    """The navigator plans no route to the goal, so that only the turns that are asked for lead there."""

    def initial_state(self, seed: int, town: Town) -> LearnedState:
        """Returns the state before the first observation."""
        state = super().initial_state(seed, town)
        memory = replace(state.attention.memory, navigator=_NoRoutes())
        return replace(state, attention=replace(state.attention, memory=memory))


@dataclass(frozen=True, kw_only=True)
class _NoRoutes(Navigator):
    """Navigator that plans nothing."""

    def to(self, town: Town, view: CoWizardView, goal: Place | None) -> Navigator:
        """Gives the route up."""
        return super().to(town, view, None)


class WithoutAnswers(LearnedCoWizard):
    """The answers that rules make of the evidence cannot be said; the other forms of the corpus can."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._needs = [needs | {"nothing has this source"} if "answer" in needs else needs for needs in self._needs]


class WithoutRules(LearnedCoWizard):
    """No rule restricts the remarks: the first remark that is drawn is said."""

    def _draw(
        self,
        shares: NDArray[np.float64],
        percept: CoWizardPercept,
        memory: WorkingMemory,
        available: Sources,
        rng: np.random.Generator,
        *,
        joined: bool = False,
    ) -> tuple[int, Remark | None]:
        chosen = drawn(shares, rng)
        remark = filled(self._vocabulary[chosen], available, joined=joined) if chosen else None
        return (0, None) if remark is None else (chosen, remark)


class RandomRemarks(LearnedCoWizard):
    """The network decides when to speak; the remark is drawn uniformly from those that the rules allow."""

    def _draw(
        self,
        shares: NDArray[np.float64],
        percept: CoWizardPercept,
        memory: WorkingMemory,
        available: Sources,
        rng: np.random.Generator,
        *,
        joined: bool = False,
    ) -> tuple[int, Remark | None]:
        even = np.where(shares > 0.0, 1.0, 0.0)
        even[0] = 0.0
        if even.sum():
            even *= (1.0 - shares[0]) / even.sum()
        even[0] = shares[0]
        return super()._draw(even, percept, memory, available, rng, joined=joined)


class Silent(LearnedCoWizard):
    """Nothing is said."""

    def play_all(
        self,
        observations: Sequence[ObservationMapping],
        states: Sequence[LearnedState],
        *,
        silent: Sequence[bool] | None = None,
    ) -> list[LearnedDecision]:
        """Takes decisions; nothing is to be said."""
        return super().play_all(observations, states, silent=[True] * len(states))


ROWS: Final[dict[str, type[LearnedCoWizard]]] = {
    "full": LearnedCoWizard,
    "random-commands": RandomCommands,
    "ruled-commands": RuledCommands,
    "frozen-listening": FrozenListening,
    "words-alone": LearnedCoWizard,
    "without-route": WithoutRoute,
    "without-answers": WithoutAnswers,
    "without-rules": WithoutRules,
    "random-remarks": RandomRemarks,
    "silent": Silent,
}
"""Players by the name of their row."""

CONFIGS: Final = {"words-alone": EnvConfig(observe_acts=False)}
"""Settings of the sessions of a row, where they are not the default ones, in which acts are observed beside words."""


def make(row: str, path: Path, role: Role, limits: SpaceLimits) -> LearnedCoWizard:
    """Returns the player of a row with the network of a folder."""
    network, page = FILES.load(path)
    return ROWS[row](network, page.vocabulary, limits)


def main(
    work: Annotated[Path, typer.Option(help="folder of the rollouts")] = Path("runs/co-wizard-ablation"),
    model: Annotated[str, typer.Option(help="name or folder of a learned Co-Wizard")] = "pretrained:co-wizard",
    rows: Annotated[str, typer.Option(help="rows, separated by commas")] = ",".join(ROWS),
    towns: Annotated[str, typer.Option(help="towns as of `dorothie-gym rollout`")] = "unseen",
    sessions: Annotated[int, typer.Option(min=1, help="sessions of a row")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="seed of the sessions")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="number of processes")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Prints success and other closed-loop metrics of each row with their 95 % intervals."""
    chosen = [row.strip() for row in rows.split(",")]
    unknown = [row for row in chosen if row not in ROWS]
    if unknown:
        raise SystemExit(f"--rows: there is no row {unknown[0]!r}; the rows are {', '.join(ROWS)}")
    found: dict[str, RolloutResult] = {}
    with reporting_errors():
        full = find_player(model, Role.CO_WIZARD)
        folder = pretrained_folder(model) if is_pretrained(model) else Path(model)
        for row in chosen:
            print(f"{row}: {work / row}", file=sys.stderr, flush=True)
            player = Player(
                name=f"{model} ({row})",
                path=folder,
                loader=partial(make, row),
                sha256=full.sha256,
                training=full.training,
            )
            settings = RolloutSettings(
                cast={**ALL_SCRIPTED, Role.CO_WIZARD: player},
                towns=parse_towns(towns),
                sessions=sessions,
                seed=seed,
                config=CONFIGS.get(row, EnvConfig()),
            )
            with session_progress(quiet=False) as on_session:
                found[row] = roll_out(settings, work / row, workers=workers, on_session=on_session)
            print(f"{row}: {_shown(found[row], 'success')}", file=sys.stderr, flush=True)
    if as_json:
        print(json.dumps({row: result.table().to_json() for row, result in found.items()}))
        return
    table = Table("row", "sessions", *(key.replace("_", " ") for key in SHOWN))
    for row, result in found.items():
        table.add_row(row, str(len(result.rows)), *(_shown(result, key) for key in SHOWN))
    Console().print(table)


def _shown(result: RolloutResult, key: str) -> str:
    """Returns a metric with its interval."""
    figure = result.figures()[key]
    scale = 1.0 if key in ("exchanges_per_subgoal", "seconds") else 100.0
    values = [None if value is None else scale * value for value in (figure.mean, figure.low, figure.high)]
    if values[0] is None:
        return "-"
    mean, low, high = (f"{value:.{0 if key == 'seconds' else 1}f}" for value in values if value is not None)
    return f"{mean} [{low}, {high}]"


if __name__ == "__main__":
    typer.run(main)
