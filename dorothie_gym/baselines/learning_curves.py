"""Charts of learning curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dorothie_gym.baselines.trainer import Epoch
from dorothie_gym.files import replacing
from dorothie_gym.ontology.roles import Role
from dorothie_gym.rendering.charts import INK, SHEET, SOFT, empty_figure, hexadecimal
from dorothie_gym.rendering.palette import CAR, INK_SOFT, NOTE, PROP, ROAD

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_loss_curves(epochs: Sequence[Epoch], title: str, path: Path) -> None:
    """Draws training and validation loss into a PNG file; the epoch that is kept is marked.

    Args:
        epochs: at least one.
        title: name of the model.
        path: file to write, whole or not at all.

    Raises:
        OSError: the file cannot be written.
    """
    # imported here: matplotlib is slow to import
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(6.4, 3.6), dpi=120, facecolor=SHEET)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.11, 0.15, 0.86, 0.73), facecolor=SHEET)
    numbers = [epoch.number for epoch in epochs]
    best = epochs[-1]
    axes.plot(numbers, [epoch.training for epoch in epochs], color=hexadecimal(ROAD), label="training")
    axes.plot(numbers, [epoch.validation for epoch in epochs], color=hexadecimal(CAR), linewidth=2, label="validation")
    axes.plot([best.best], [best.lowest], "o", color=hexadecimal(CAR), label=f"kept: epoch {best.best}")
    axes.set_title(title, loc="left", fontsize=11, color=INK, weight="bold")
    axes.set_xlabel("epoch", fontsize=9, color=SOFT)
    axes.set_ylabel("loss", fontsize=9, color=SOFT)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y", color="white")
    axes.tick_params(labelsize=8, colors=SOFT, length=0)
    axes.legend(frameon=False, fontsize=8, labelcolor=INK)
    for side in axes.spines.values():
        side.set_visible(False)
    with replacing(path) as part:
        figure.savefig(part, format="png")


# --- The learning curve as a picture ---------------------------------------------------------------------------------

FIGURE_SIZE = (7.0, 4.0)
"""Width and height of the picture [inches]."""

DOTS_PER_INCH = 150
"""Resolution of the picture [1/inch]."""


@contextmanager
def sheet(path: Path) -> Iterator[Figure]:
    """Yields an empty figure, which is written to a PNG file afterwards.

    Raises:
        OSError: the file cannot be written.
    """
    with empty_figure(*FIGURE_SIZE) as figure:
        figure.set_layout_engine("constrained")
        yield figure
        with replacing(path) as part:
            figure.savefig(part, format="png", dpi=DOTS_PER_INCH)


def draw_reward_curve(rows: Sequence[Mapping[str, Any]], title: str, path: Path) -> None:
    """Draws success with its interval, and the reward, over the steps into a PNG file.

    Args:
        rows: evaluations, as `training.TrainingEvaluation.as_json` has them.
        title: above the picture.
        path: file to write.

    Raises:
        OSError: the file cannot be written.
    """
    steps = [row["steps"] / 1e3 for row in rows]
    with sheet(path) as figure:
        axes = figure.add_subplot()
        axes.set_facecolor(SHEET)
        axes.fill_between(
            steps, [row["low"] for row in rows], [row["high"] for row in rows], color=hexadecimal(CAR), alpha=0.2, lw=0
        )
        axes.plot(steps, [row["success"] for row in rows], color=hexadecimal(CAR), lw=2, marker="o", ms=3)
        axes.set(ylim=(-0.02, 1.02), xlabel="thousand steps", ylabel=f"success of {rows[-1]['episodes']} episodes")
        axes.yaxis.label.set_color(hexadecimal(CAR))
        rewards = axes.twinx()
        rewards.plot(steps, [row["reward"] for row in rows], color=SOFT, lw=1.2, ls="--")
        rewards.set_ylabel("mean reward of an episode (dashed)", color=SOFT)
        axes.set_title(f"{title}; one seed, {rows[-1]['seconds'] / 60:.1f} min of training", color=INK, fontsize=10)


# --- The curves of self-play as a picture ----------------------------------------------------------------------------

_LINES = {
    Role.CO_WIZARD: ("Co-Wizard", CAR, "-"),
    Role.PARTICIPANT: ("participant", PROP, (0, (3, 3))),  # has the Co-Wizard's reward: both lines are to be seen
    Role.AD_WIZARD: ("Ad-Wizard", NOTE, "-"),
}


def draw_selfplay_curve(rows: Sequence[Mapping[str, Any]], title: str, path: Path) -> None:
    """Draws each role's reward, and the team's success, over the steps into a PNG file.

    Args:
        rows: evaluations, as `training.TrainingEvaluation.as_json` has them.
        title: above the picture.
        path: file to write.

    Raises:
        OSError: the file cannot be written.
    """
    with sheet(path) as figure:
        returns, success = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for role, (name, colour, style) in _LINES.items():
            known = [row for row in rows if row["returns"][role] is not None]
            steps, values = [row["steps"] / 1e3 for row in known], [row["returns"][role] for row in known]
            returns.plot(steps, values, color=hexadecimal(colour), lw=2, ls=style, marker="o", ms=3, label=name)
        returns.set_ylabel("reward of a session")
        returns.legend(frameon=False)
        for name, colour, style in (("scripted", INK_SOFT, "-"), ("learned", NOTE, "--")):
            steps, values = [row["steps"] / 1e3 for row in rows], [row[name]["success"] for row in rows]
            success.plot(
                steps, values, color=hexadecimal(colour), lw=2, ls=style, marker="o", ms=3, label=f"{name} Ad-Wizard"
            )
        success.set(ylim=(-0.04, 1.04), xlabel="thousand steps", ylabel="success against")
        success.legend(frameon=False)
        for axes in (returns, success):
            axes.set_facecolor(SHEET)
        minutes = rows[-1]["seconds"] / 60
        returns.set_title(f"{title}; one seed, {minutes:.1f} min of training", color=INK, fontsize=10)
