"""A measurement as a picture: bars with the reference, and the line of real time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dorothie_gym.bench.report import Report, number
from dorothie_gym.rendering.charts import INK, SHEET, SOFT, hexadecimal
from dorothie_gym.rendering.palette import CAR, LIGHT_RED, ROAD

SIZE = 9.0
"""Width of the picture [inches]."""

DOTS = 150
"""Dots an inch."""

_ROW, _AROUND = 0.72, 1.95
_FONT = "DejaVu Sans"


def draw(report: Report, path: Path) -> None:
    """Draws a report into a PNG file.

    Args:
        report: what to show.
        path: file to write.

    Raises:
        OSError: the file cannot be written.
    """
    # imported here: matplotlib is slow to import, and a picture is not always wanted
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({"font.family": _FONT}):
        rows, notes = _ROW * len(report.rows), 0.2 * len(report.notes)
        height = rows + _AROUND + notes
        figure = Figure(figsize=(SIZE, height), dpi=DOTS, facecolor=SHEET)
        FigureCanvasAgg(figure)
        _words(figure, report, height)
        axes = figure.add_axes(
            (0.29, (0.83 + 0.2 * len(report.notes)) / height, 0.66, _ROW * len(report.rows) / height)
        )
        _bars(axes, report)
        figure.savefig(path, format="png")


def _words(figure: Any, report: Report, height: float) -> None:
    """Title and what it is about above the bars, notes and machine below."""

    def say(inches: float, text: str, **style: Any) -> None:
        figure.text(0.03, inches / height, text, va="baseline", **style)

    say(height - 0.42, report.headline[0].upper() + report.headline[1:], fontsize=13.5, weight="bold", color=INK)
    say(height - 0.72, f"{report.title} · {report.setting}", fontsize=9, color=SOFT)
    for k, note in enumerate(reversed(report.notes)):
        say(0.36 + 0.2 * k, note, fontsize=8.5, color=INK)
    say(0.14, report.machine, fontsize=7, color=SOFT)


def _bars(axes: Any, report: Report) -> None:
    values = [row.value for row in report.rows]
    known = [*values, report.mark.value] if report.mark else values
    places = range(len(values))
    if report.logarithmic:
        axes.set_xscale("log")
        left, right = min(known) / 3.0, max(known) * 12.0
    else:
        left, right = 0.0, max(known) * 1.25
    axes.set_xlim(left, right)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.10g}")
    colours = [hexadecimal(ROAD if row.reference else CAR) for row in report.rows]
    axes.barh(places, [value - left for value in values], left=left, height=0.56, color=colours, zorder=2)
    for k, row in enumerate(report.rows):
        axes.annotate(
            number(row.value), (row.value, k), xytext=(6, 0), textcoords="offset points", va="center", fontsize=11,
            weight="bold", color=colours[k], zorder=4,
        )  # fmt: skip
    if report.mark is not None:
        axes.axvline(report.mark.value, color=hexadecimal(LIGHT_RED), linewidth=1.4, linestyle=(0, (4, 3)), zorder=3)
        axes.annotate(
            report.mark.label, (report.mark.value, 1.0), xycoords=("data", "axes fraction"), xytext=(4, 3),
            textcoords="offset points", fontsize=8.5, color=hexadecimal(LIGHT_RED),
        )  # fmt: skip
    axes.set_yticks(list(places), [row.label for row in report.rows], fontsize=9, color=INK)
    axes.set_ylim(len(values) - 0.5, -0.5)
    axes.set_xlabel(report.unit + (" (logarithmic)" if report.logarithmic else ""), fontsize=8.5, color=SOFT)
    axes.tick_params(axis="x", labelsize=8, colors=SOFT, which="both", length=0)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="white", linewidth=1.0, zorder=0)
    axes.set_facecolor(SHEET)
    for side in axes.spines.values():
        side.set_visible(False)
