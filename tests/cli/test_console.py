"""`dorothie-gym console`: links, mistakes, and the end at Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.session.recording import Session

sockets = pytest.importorskip("websockets.sync.client", reason="needs the extra console")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--roles", "pilot=human"], "the roles are participant, co_wizard, ad_wizard"),
        (["--roles", "participant=robot"], "there is no policy 'robot'"),
        (["--after-absence", "shrug"], "--after-absence is 'shrug'; it must be end or script or wait"),
        (["--town", "atlantis"], "atlantis"),
        (["--host", "203.0.113.7"], "203.0.113.7:8023 cannot be used"),
    ],
)
def test_mistakes_are_named(options: list[str], message: str) -> None:
    result = CliRunner().invoke(app, ["console", "--no-pictures", *options])
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


@pytest.mark.long
def test_a_link_for_each_seat_and_a_complete_record_at_the_end(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "dorothie_gym.cli", "console", "--port", "0", "--json", "--no-pictures"]
    command += ["--roles", "ad_wizard=silent", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ) as server:
        try:
            assert server.stdout is not None
            links = json.loads(server.stdout.readline())["links"]
            assert list(links) == ["participant", "co_wizard", "experimenter", "spectator"]
            address, _, token = links["co_wizard"].partition("/seat#")
            with sockets.connect(address.replace("http", "ws") + "/ws") as socket:
                socket.send(json.dumps({"k": "join", "token": token}))
                assert [json.loads(socket.recv(timeout=10))["k"] for _ in range(8)][:2] == ["hello", "frame"]
            server.send_signal(signal.SIGINT)
            server.wait(20)
        finally:
            server.kill()
    (folder,) = tmp_path.iterdir()
    session = Session.load(folder)
    assert session.complete
    assert session.header.extra["seats"] == {"participant": "open", "co_wizard": "open", "ad_wizard": "silent"}


@pytest.mark.long
def test_ctrl_c_states_what_was_recorded(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "dorothie_gym.cli", "console", "--port", "0", "--no-pictures"]
    command += ["--roles", "ad_wizard=silent", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ) as server:
        try:
            assert server.stdout is not None
            links = [server.stdout.readline() for _ in range(5)]
            address, _, token = links[1].split()[-1].partition("/seat#")
            with sockets.connect(address.replace("http", "ws") + "/ws") as socket:
                socket.send(json.dumps({"k": "join", "token": token}))
                assert [json.loads(socket.recv(timeout=10))["k"] for _ in range(8)][:2] == ["hello", "frame"]
            server.send_signal(signal.SIGINT)
            rest = server.stdout.read()
            server.wait(20)
        finally:
            server.kill()
    (folder,) = tmp_path.iterdir()
    assert f"Recorded: {folder} (complete)" in " ".join(rest.split())
