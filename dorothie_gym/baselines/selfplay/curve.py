"""The curves of self-play as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dorothie_gym.baselines.rl.curve import sheet
from dorothie_gym.ontology import Role
from dorothie_gym.rendering.charts import INK, SHEET, hexadecimal
from dorothie_gym.rendering.palette import CAR, INK_SOFT, NOTE, PROP

_LINES = {
    Role.CO_WIZARD: ("Co-Wizard", CAR, "-"),
    Role.PARTICIPANT: ("participant", PROP, (0, (3, 3))),  # has the Co-Wizard's reward: both lines are to be seen
    Role.AD_WIZARD: ("Ad-Wizard", NOTE, "-"),
}


def draw_curve(rows: Sequence[Mapping[str, Any]], title: str, path: Path) -> None:
    """Draws each role's reward, and the team's success, over the steps into a PNG file.

    Args:
        rows: evaluations, as `training.Row.as_json` has them.
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
        returns.set_title(f"{title}; {minutes:.1f} min of training", color=INK, fontsize=10)
