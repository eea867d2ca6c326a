"""`dorothie-gym play`: one seat in the browser, or keys in the terminal."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.applications import Starlette
from typer.testing import CliRunner

from dorothie_gym.cli import play as module
from dorothie_gym.cli.app import app
from dorothie_gym.cli.play import ROLES
from dorothie_gym.cli.terminal_play import COMMANDS, DRIVING, END_OF_INPUT, TerminalKeys, small_picture
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.wrappers.macro_actions import MACRO_ACTIONS


def play(*arguments: str, keys: str = "") -> Any:
    return CliRunner().invoke(app, ["play", *arguments], input=keys)


def test_co_wizard_drives_and_talks_by_keys_until_the_time_is_up() -> None:
    done = play(
        "--terminal", "--town", "brookside", "--seed", "7", "--max-seconds", "20", keys="?f    v x g" + 40 * " "
    )
    assert done.exit_code == 0, done.output
    for words in ("Keys: space continue", "You: ask where to", "Participant: ", "km/h", "@@@", "The session is over."):
        assert words in done.stdout


def test_navigation_is_driven_by_keys_and_quit() -> None:
    done = play("navigation", "--town", "brookside", "--seed", "3", keys="      +  q")
    assert done.exit_code == 0, done.output
    assert "Participant: " in done.stdout and "You: faster" in done.stdout
    assert "The session is over" not in done.stdout and "You have left the session." in done.stdout


def test_impossible_keys_are_explained_and_the_end_of_the_input_ends_the_play() -> None:
    done = play("--terminal", "--town", "brookside", "--seed", "7", keys="m")
    assert done.exit_code == 0 and "say goal is not possible now" in done.stdout


def test_the_end_of_the_input_and_an_empty_input_are_named() -> None:
    done = play("navigation", "--town", "brookside", "--seed", "7", keys=" ")
    assert done.exit_code == 0 and done.stdout.endswith("The input has ended; so has the session.\n")
    done = play("navigation", "--town", "brookside", "--seed", "7")
    assert done.exit_code == 2 and "there are no keys: the input is empty" in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="terminals of other systems have no devices")
def test_keys_of_a_terminal_are_read_one_at_a_time() -> None:
    import pty

    master, terminal = pty.openpty()
    with (
        os.fdopen(master, "wb", buffering=0) as keyboard,
        os.fdopen(terminal, "rb", buffering=0) as device,
        open_keys(device) as read,
    ):
        keyboard.write("g\x1b[A\x1b[1;5C\x1bOP\x1b[3~é \x1b".encode())
        pressed = [read() for _ in range(8)]
        keyboard.write(b"\x04")
        pressed.append(read())
    assert pressed == ["g", "\x1b[A", "\x1b[1;5C", "\x1bOP", "\x1b[3~", "é", " ", "\x1b", END_OF_INPUT]


@contextmanager
def open_keys(device: Any) -> Iterator[Callable[[], str]]:
    """Yields the reader of keys of a terminal's device, which is in cbreak mode then."""
    import termios
    import tty

    before = termios.tcgetattr(device)
    tty.setcbreak(device)
    yield TerminalKeys(device.fileno()).read
    termios.tcsetattr(device, termios.TCSANOW, before)


@pytest.mark.parametrize("path", ["a_file", "a_file/below", "/proc/nowhere"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_seat_is_opened(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a_file").touch()
    done = play("--town", "brookside", "--out", path)
    assert done.exit_code == 2 and done.stdout == "" and path in done.stderr and done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "a_file"]


def test_every_action_has_a_key() -> None:
    assert set(COMMANDS.values()) == {one.name for one in MACRO_ACTIONS if one.place is None}
    assert set(DRIVING.values()) == {action.name for action in NavigationAction}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("co-wizzard",), "there is no role 'co-wizzard'; did you mean 'co-wizard'? the roles are participant"),
        (
            ("participant", "--terminal"),
            "--terminal plays co-wizard and navigation; participant is",
        ),
        (("--terminal", "--out", "sessions"), "--out and --storyboard are for the browser"),
    ],
)
def test_mistakes_are_one_line(arguments: tuple[str, ...], message: str) -> None:
    done = play(*arguments)
    assert done.exit_code == 2 and message in done.output


@pytest.mark.parametrize("role", [role for role in ROLES if role != "navigation"])
def test_one_seat_is_opened_and_scripts_play_the_others(role: str, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    served: list[Starlette] = []

    def serve(application: Starlette, listener: socket.socket, host: str) -> None:
        served.append(application)
        listener.close()

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(module.webbrowser, "open", lambda link: bool(opened.append(link)) or True)
    monkeypatch.setattr(module, "serve", serve)
    done = play(role, "--town", "brookside")
    assert done.exit_code == 0, done.output
    assert len(opened) == len(served) == 1 and "/seat#" in opened[0]
    assert opened[0] in done.stdout.replace("\n", "")


def test_without_a_browser_the_link_and_the_keys_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(module, "serve", lambda application, listener, host: listener.close())
    done = play("--town", "brookside")
    assert "No browser can be opened here" in done.stdout and "--terminal" in done.stdout and "/seat#" in done.stdout


def test_small_picture_keeps_proportions_and_colours() -> None:
    picture = np.zeros((40, 80, 3), dtype=np.uint8)
    picture[:20] = (255, 0, 0)
    text = small_picture(picture, 40)
    rows = text.plain.splitlines()
    assert len(rows) == 10 and {len(row) for row in rows} == {40}
    assert str(text.spans[0].style) == "rgb(255,0,0) on rgb(255,0,0)"


def test_small_picture_fits_the_lines_and_needs_no_colours() -> None:
    picture = np.zeros((400, 800, 3), dtype=np.uint8)
    picture[:200] = 255
    text = small_picture(picture, 100, 10, coloured=False)
    assert text.plain.splitlines() == 5 * ["@" * 40] + 5 * [" " * 40]
    assert not text.spans
