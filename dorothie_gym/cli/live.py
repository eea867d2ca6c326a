"""Live display of a session on the terminal: scrolling dialogue, with tasks and clock below."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeAlias

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from dorothie_gym.cli.output import Facts
from dorothie_gym.dialogue.street_titles import NO_TITLES, StreetTitles
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.pictures.views.exception_words import exception_words
from dorothie_gym.session.live_session import LiveSession
from dorothie_gym.session.recording.events import Event, EventType, move_record
from dorothie_gym.session.recording.files import Fields
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.tasks.storyboard import TaskState

if TYPE_CHECKING:
    from dorothie_gym.cli.live_film import Film

EventData: TypeAlias = Mapping[str, Any]
"""Data of an event, whose fields depend on its type."""

SPEAKERS: Mapping[Role, tuple[str, str]] = {
    Role.PARTICIPANT: ("Participant", "bold cyan"),
    Role.CO_WIZARD: ("Co-Wizard", "bold blue"),
    Role.AD_WIZARD: ("Ad-Wizard", "bold magenta"),
    Role.AGENT: ("Car", "bold yellow"),
}
"""Displayed name of each role and its style."""


@dataclass(frozen=True, kw_only=True)
class ScriptLine:
    """Line of the displayed transcript.

    Attributes:
        time: time of the event [s].
        speaker: role that speaks or acts.
        text: words, or description of the event.
        style: style of the text.
        acts: short form of the dialogue acts; empty for other events.
    """

    time: float
    speaker: Role
    text: str
    style: str = ""
    acts: str = ""


def script_lines(
    events: Iterable[Event], task: Callable[[int], str], titles: StreetTitles = NO_TITLES
) -> list[ScriptLine]:
    """Returns the lines for the events of a decision; internal events have none.

    Args:
        events: the events.
        task: returns the description of a subgoal by its number.
        titles: names of the map for the streets.
    """
    lines: list[ScriptLine] = []
    last: int | None = None
    for event in events:
        if event.type is not EventType.DIALOGUE_MOVE:
            if event.type is EventType.SUBGOAL:
                text, style = _subgoal(event.data, task(Fields(event.data, "event").integer("subgoal")))
                lines.append(ScriptLine(time=event.time, speaker=event.source, text=text, style=style))
            elif (describe := _DESCRIBED.get(event.type)) is not None:
                text, style = describe(event.data)
                lines.append(ScriptLine(time=event.time, speaker=event.source, text=text, style=style))
            continue
        move = move_record(event, -1)
        act = titles.shown(str(move.act).removesuffix("()"))
        if move.utterance == last:  # a further act of the same utterance
            before = lines.pop()
            act = f"{before.acts} {act}"
        last = move.utterance
        lines.append(ScriptLine(time=event.time, speaker=event.source, text=titles.shown(move.text), acts=act))
    return lines


def _message(data: EventData) -> tuple[str, str]:
    return f"“{data['text']}”", "magenta"


def _physical(data: EventData) -> tuple[str, str]:
    text = str(data["action"])
    if data["angle"] is not None:
        side = "left" if data["angle"] > 0 else "right"
        text += f" {abs(data['angle'])}° {side}" if data["angle"] else " straight on"
    elif data["up"] is not None:
        text += (" up" if data["up"] else " down") if text == "SpeedChange" else (" on" if data["up"] else " off")
    return text, "dim"


def _exception(data: EventData) -> tuple[str, str]:
    return exception_words(data), "magenta"


def _hazard(data: EventData) -> tuple[str, str]:
    return f"stops for a hazard {data['distance']:.0f} m ahead: {data['reason']}", "yellow"


def _collision(data: EventData) -> tuple[str, str]:
    fault = "its own fault" if data["own_fault"] else "not its fault"
    return f"collides at {data['speed'] * 3.6:.0f} km/h: {data['other']} ({fault})", "bold red"


def _breach(text: str) -> Callable[[EventData], tuple[str, str]]:
    return lambda data: (text, "bold red")


def _subgoal(data: EventData, task: str) -> tuple[str, str]:
    status = data["status"]
    if status == "Complete":
        return f"arrives. Done: {task}", "bold green"
    return f"{'No longer' if status == 'Abandoned' else 'Now'}: {task}", "magenta"


_DESCRIBED: Mapping[EventType, Callable[[EventData], tuple[str, str]]] = {
    EventType.MESSAGE: _message,
    EventType.PHYSICAL_ACTION: _physical,
    EventType.EXCEPTION: _exception,
    EventType.HAZARD_STOP: _hazard,
    EventType.COLLISION: _collision,
    EventType.RED_LIGHT: _breach("runs a red light"),
    EventType.STOP_SIGN: _breach("passes a stop sign without standing"),
    EventType.OFF_ROAD: _breach("leaves the road"),
    EventType.WRONG_WAY: _breach("drives against the traffic"),
}


# --- Live view on the terminal ----------------------------------------------------------------------------------------

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


class Pace:
    """Delays a session to a multiple of real time; pass it to `play_session` as `on_step`.

    Attributes:
        seconds: time spent waiting [s].

    Args:
        speed: simulated seconds per second.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._begun: float | None = None
        self.seconds = 0.0

    def __call__(self, engine: SessionEngine) -> None:
        """Waits until the time of the current decision."""
        now = time.perf_counter()
        if self._begun is None:
            self._begun = now
        wait = self._begun + engine.session.world.time / self._speed - now
        if wait > 0.0:
            time.sleep(wait)
            self.seconds += time.perf_counter() - now


class LiveShow:
    """Shows a session while it is played; pass it to `play_session` as `on_step`.

    On a terminal, tasks and clock stay below the dialogue; only the dialogue is written into a file or a pipe.

    Args:
        console: console for the output.
        film: video of the session, whose progress is shown.
        pace: delay of the session.
    """

    def __init__(self, console: Console, film: Film | None = None, pace: Pace | None = None) -> None:
        self._console, self._film, self._pace = console, film, pace
        self._width = min(console.width, _WIDEST)
        self._live = Live(console=console, refresh_per_second=8, transient=True) if console.is_terminal else None
        self._begun: float | None = None

    def __enter__(self) -> Self:
        """Starts the display."""
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Removes tasks and clock from the terminal."""
        if self._live is not None:
            self._live.stop()

    def __call__(self, engine: SessionEngine) -> None:
        """Shows the events of the last decision."""
        begun = self._begun
        if begun is None:
            begun = self._begun = time.perf_counter()
            self._console.print(_opening(engine.session, self._console, self._width))
        session = engine.session
        lines = script_lines(engine.last_events, session.task.description, session.scenario.titles)
        if lines:
            self._console.print(_script(lines, self._width))
        if self._live is not None:
            self._live.update(self._standing(engine, begun))

    def _standing(self, engine: SessionEngine, begun: float) -> RenderableType:
        task, seconds = engine.session.task, engine.session.world.time
        apart = sum(each.seconds for each in (self._film, self._pace) if each is not None)
        wall = max(time.perf_counter() - begun - apart, 1e-6)
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
        if self._film is not None:
            drawn = f"video: {self._film.frames} frames drawn in {clock(self._film.seconds)}"
            bar.add_row("", Text(drawn, style="dim"))
        return Group(Text(""), tasks(task, self._console), bar)


def tasks(task: TaskState, console: Console) -> RenderableType:
    """Returns a table of the live subgoals; those that are reached are green."""
    table = Table.grid(padding=(0, 1))
    for i in task.live:
        unicode, ascii_only, style = _MARKS[task.status(i)]
        mark = ascii_only if console.options.ascii_only else unicode
        table.add_row(Text(mark, style=style), Text(task.description(i), style=style))
    return table


def summary(facts: Facts, files: dict[str, str], console: Console) -> RenderableType:
    """Returns the outcome of a session.

    Args:
        facts: output of `dorothie-gym run --json`.
        files: paths of the written files, by kind.
        console: console for the output.
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
        **{f"llm {role}": _usage_words(usage) for role, usage in facts.get("usage", {}).items()},
        **files,
    }
    for name, value in rows.items():
        table.add_row(Text(name, style="dim"), Text(value, overflow="fold"))
    return Group(_rule(console), headline, table)


def _usage_words(usage: Facts) -> str:
    """Returns calls, tokens, latency and silent actions of a language model on one line."""
    words = (
        f"{usage['calls']} calls of {usage['model']}, {usage['prompt_tokens']} + {usage['completion_tokens']} tokens, "
        f"{usage['latency']:.1f} s"
    )
    if usage["cost"] is not None:
        words += f", {usage['cost']:.4f} $"
    silences = ", ".join(f"{count} x {name}" for name, count in usage["silences"].items())
    return f"{words}; silent: {silences}" if silences else words


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
