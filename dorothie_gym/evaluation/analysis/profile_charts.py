"""Charts of the profiles of moves and slots (figures 3 to 5 of the paper)."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Final

from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.evaluation.analysis.profiles import CLASSES, SLOTS, Profile, Profiles, counted
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.pictures.chart_style import GRID, INK, SHEET, SOFT, empty_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHART_SIZE: Final = (12.0, 9.2)
"""Width and height of the picture [inches]."""

LABEL_WIDTH: Final = 17
"""Characters in a line below a bar."""

_COLOURS: Final = {
    Handled.ENVIRONMENTAL: ("#9bd0b5", "#2f8f62"),
    Handled.TASK: ("#f3cb8d", "#cf7f1d"),
    Handled.NONE: ("#a9c4f2", "#2f62c4"),
}
"""Colours of people (light) and the car (dark)."""

_SPEAKERS: Final = ((Role.PARTICIPANT, "human"), (Role.CO_WIZARD, "car"))


def draw_profiles(profiles: Profiles, heading: str, title: str, path: Path) -> None:
    """Draws moves and slots per transaction by speaker, and per exchange by the kind of exception that it handles.

    Args:
        profiles: profiles of the corpus.
        heading: line below the title (`Counts.heading`).
        title: name of the corpus.
        path: PNG file to write.

    Raises:
        OSError: the file cannot be written.
    """
    with empty_figure(*CHART_SIZE) as figure:
        grid = figure.add_gridspec(
            2, 2, left=0.06, right=0.98, top=0.85, bottom=0.09, hspace=0.52, wspace=0.13, width_ratios=(14, 8)
        )
        figure.text(0.06, 0.95, title, fontsize=15, weight="bold")
        figure.text(0.06, 0.918, heading, fontsize=10, color=SOFT)
        _per_transaction(figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1]), profiles.transactions)
        _per_exchange(figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1]), profiles)
        figure.savefig(path, format="png")


def _per_transaction(moves: Axes, slots: Axes, profile: Profile) -> None:
    shown = [move for move in DialogueMove if move is not DialogueMove.IRRELEVANT] + [DialogueMove.IRRELEVANT]
    light, dark = _COLOURS[Handled.NONE]
    for k, (role, name) in enumerate(_SPEAKERS):
        colour = (light, dark)[k]
        at = [x + (k - 0.5) * 0.4 for x in range(len(shown))]
        moves.bar(at, [profile.mean_move(role, move) for move in shown], 0.38, color=colour, label=name)
        at = [x + (k - 0.5) * 0.4 for x in range(len(SLOTS))]
        slots.bar(at, [profile.mean_slot(role, slot) for slot in SLOTS], 0.38, color=colour)
    _dress(moves, "Moves in a transaction", [move.label for move in shown], slanted=True)
    _dress(slots, "Slot values in a transaction", [slot.label for slot in SLOTS])
    for axes in (moves, slots):
        _give_room(axes, 1.06)
    moves.legend(frameon=True, facecolor=SHEET, edgecolor=SHEET, framealpha=1.0, fontsize=9, loc="upper right")


def _per_exchange(moves: Axes, slots: Axes, profiles: Profiles) -> None:
    width = 0.13
    bars = [(kind, k, role) for kind in Handled for k, (role, _) in enumerate(_SPEAKERS)]
    for place, (kind, k, role) in enumerate(bars):
        profile, colour = profiles.exchanges[kind], _COLOURS[kind][k]
        offset = (place - (len(bars) - 1) / 2) * width
        units = "" if k else f" ({counted(profile.units, 'exchange')})"
        label = f"{kind.value}, {_SPEAKERS[k][1]}{units}"
        heights = [profile.mean_move(role, *group) for group in CLASSES.values()]
        moves.bar([x + offset for x in range(len(CLASSES))], heights, width * 0.93, color=colour, label=label)
        heights = [profile.mean_slot(role, slot) for slot in SLOTS]
        slots.bar([x + offset for x in range(len(SLOTS))], heights, width * 0.93, color=colour)
    _dress(moves, "Moves in an exchange, by the exception that it handles", [_class_label(name) for name in CLASSES])
    _dress(slots, "Slot values in an exchange, likewise", [slot.label for slot in SLOTS])
    for axes in (moves, slots):
        axes.set_title(axes.get_title(loc="left"), loc="left", fontsize=11, color=INK, pad=_LEGEND_ROOM)
    # between title and axes, where it covers neither bars nor ticks
    moves.legend(
        frameon=False,
        fontsize=8,
        ncols=3,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.01),
        borderaxespad=0.0,
        borderpad=0.0,
        columnspacing=1.2,
    )


_LEGEND_ROOM: Final = 36
"""Distance between title and axes where the legend is between them [points]."""


def _class_label(name: str) -> str:
    """Returns the name of a class of moves, and the names of its moves below it."""
    moves = [move.label for move in CLASSES[name]]
    if moves == [name]:
        return name
    return "\n".join([name, *wrap(", ".join(moves), LABEL_WIDTH)])


def _give_room(axes: Axes, times: float) -> None:
    """Leaves room above the bars."""
    axes.set_ylim(0.0, axes.get_ylim()[1] * times)


def _dress(axes: Axes, title: str, labels: list[str], *, slanted: bool = False) -> None:
    axes.set_facecolor(SHEET)
    axes.set_title(title, loc="left", fontsize=11, color=INK, pad=10)
    axes.set_xticks(range(len(labels)), labels, fontsize=9 if "\n" not in "".join(labels) else 7.5, color=INK)
    if slanted:
        for label in axes.get_xticklabels():
            label.set(rotation=32, ha="right", rotation_mode="anchor")
    axes.tick_params(axis="both", length=0)
    axes.tick_params(axis="y", labelsize=8, labelcolor=SOFT)
    axes.set_ylabel("mean number", fontsize=8.5)
    axes.grid(axis="y", color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side == "bottom")
        spine.set_color(SOFT)
