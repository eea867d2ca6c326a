"""A session on the terminal while it is played: the talk scrolls, tasks and clock stand below it."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Any, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from dorothie_gym.cli.script import SPEAKERS, ScriptLine, script_lines
from dorothie_gym.engine.live_session import LiveSession
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.ontology import GoalStatus
from dorothie_gym.tasks import TaskState

_WIDEST = 100
_MARKS: dict[GoalStatus, tuple[str, str, str]] = {
    # mark, the same in ASCII, style
    GoalStatus.COMPLETE: ("✔", "x", "bold green"),
    GoalStatus.ONGOING: ("▸", ">", ""),
    GoalStatus.PENDING: ("·", ".", "dim"),
}


def clock(seconds: float) -> str:
    """Returns minutes and seconds, as "4:07"."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


class LiveShow:
    """Shows a session as it is played; hand it to `play_session` as `on_step`.

    On a terminal, tasks and clock stay below the talk; into a file or a pipe only the talk is written.

    Args:
        console: where to show it.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._width = min(console.width, _WIDEST)
        self._live = Live(console=console, refresh_per_second=8, transient=True) if console.is_terminal else None
        self._begun: float | None = None

    def __enter__(self) -> Self:
        """Begins to show."""
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Takes tasks and clock off the terminal."""
        if self._live is not None:
            self._live.stop()

    def __call__(self, engine: SessionEngine) -> None:
        """Shows what happened in the last decision."""
        if self._begun is None:
            self._begun = time.perf_counter()
            self._console.print(_opening(engine.session, self._console, self._width))
        lines = script_lines(engine.last_events, engine.session.task.description)
        if lines:
            self._console.print(_script(lines, self._width))
        if self._live is not None:
            self._live.update(self._standing(engine))

    def _standing(self, engine: SessionEngine) -> RenderableType:
        assert self._begun is not None
        task, seconds = engine.session.task, engine.session.world.time
        wall = max(time.perf_counter() - self._begun, 1e-6)
        reached = sum(task.reached(i) for i in task.live)
        bar = Table.grid(padding=(0, 1))
        bar.add_row(
            Text(clock(seconds), style="bold"),
            ProgressBar(
                total=len(task.live),
                completed=reached,
                width=max(self._width - 46, 10),
                complete_style="green",
                finished_style="green",
            ),
            Text(f"{reached} of {len(task.live)} tasks"),
            Text(f"{seconds / wall:.0f} x real time", style="dim"),
        )
        return Group(Text(""), tasks(task, self._console), bar)


def tasks(task: TaskState, console: Console) -> RenderableType:
    """The live subgoals, those that are reached in green."""
    table = Table.grid(padding=(0, 1))
    for i in task.live:
        unicode, ascii_only, style = _MARKS[task.status(i)]
        mark = ascii_only if console.options.ascii_only else unicode
        table.add_row(Text(mark, style=style), Text(task.description(i), style=style))
    return table


def summary(facts: dict[str, Any], files: dict[str, str], console: Console) -> RenderableType:
    """How a session ended.

    Args:
        facts: what `dorothie-gym run --json` writes.
        files: what was written where.
        console: where it will be shown.
    """
    subgoals = facts["subgoals"]
    if facts["success"]:
        headline = Text("Success", style="bold green")
    elif facts["arrived"]:
        headline = Text("Arrived, but not without fault", style="bold yellow")
    else:
        headline = Text("Did not arrive in time", style="bold red")
    rate = facts["seconds"] / max(facts["wall_seconds"], 1e-6)
    table = Table.grid(padding=(0, 2))
    rows = {
        "subgoals": f"{subgoals['reached']} of {subgoals['live']} reached",
        "collisions": f"{facts['collisions']} of its own making",
        "time": f"{clock(facts['seconds'])} simulated in {facts['wall_seconds']:.1f} s: {rate:.0f} x real time",
        "talk": f"{facts['utterances']} utterances, {facts['acts']} acts",
        "driving": f"{facts['physical_actions']} physical actions",
        "exceptions": str(facts["exceptions"]),
        **files,
    }
    for name, value in rows.items():
        table.add_row(Text(name, style="dim"), Text(value, overflow="fold"))
    return Group(_rule(console), headline, table)


def _opening(session: LiveSession, console: Console, width: int) -> RenderableType:
    board = session.scenario.storyboard
    title = Text.assemble(
        (session.world.town.name, "bold"), " · ", (board.name, "bold"), (f" · seed {session.scenario.seed}", "dim")
    )
    story = Table.grid()
    story.add_column(width=min(width, 80))
    story.add_row(Text(board.story, style="italic"))
    return Group(title, story, tasks(session.task, console), _rule(console))


def _rule(console: Console) -> Text:
    return Text(("-" if console.options.ascii_only else "─") * min(console.width, _WIDEST), style="dim")


def _script(lines: list[ScriptLine], width: int) -> Table:
    table = Table.grid(padding=(0, 1))
    table.add_column(width=5, justify="right", style="dim")
    table.add_column(width=11, no_wrap=True)
    table.add_column(width=width - 18)
    for line in lines:
        name, style = SPEAKERS[line.speaker]
        said = Text(line.text, style=line.style)
        if line.acts:
            said.append(f"\n{line.acts}", style="dim")
        table.add_row(clock(line.time), Text(name, style=style), said)
    return table
