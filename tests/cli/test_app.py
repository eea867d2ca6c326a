from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

import dorothie_gym
from dorothie_gym.cli import app
from dorothie_gym.maps import describe, load_town
from dorothie_gym.session.recording import Session
from dorothie_gym.support.installation import pip_install

ROOT = Path(__file__).parents[2]
RUN_KEYS = [
    "town", "storyboard", "seed", "success", "subgoals", "arrived", "collisions", "seconds", "wall_seconds",
    "utterances", "acts", "physical_actions", "exceptions", "session",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands may write into the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def loaded(*arguments: object) -> Any:
    result = call(*arguments)
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    return json.loads(result.stdout)


def process(*arguments: object, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    command = [sys.executable, "-m", "dorothie_gym.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)


class TestRun:
    def test_json_has_exactly_the_documented_keys(self) -> None:
        facts = loaded("run", "--seed", 3, "--max-seconds", 4, "--json")
        assert list(facts) == RUN_KEYS
        assert list(facts["subgoals"]) == ["live", "reached"]
        assert facts["town"] == "millbrook" and facts["seed"] == 3 and facts["seconds"] == 4.0
        assert facts["session"] is None and facts["arrived"] is False
        assert not any(Path().iterdir()), "nothing is written that was not asked for"

    @pytest.mark.long
    def test_standard_output_is_json_and_nothing_else(self, tmp_path: Path) -> None:
        picture, session = tmp_path / "p.png", tmp_path / "s"
        arguments = ("run", "--max-seconds", 2, "--json", "--picture", picture, "--out", session)
        done = process(*arguments, PYGAME_HIDE_SUPPORT_PROMPT="")
        assert done.returncode == 0 and done.stderr == ""
        assert list(json.loads(done.stdout)) == RUN_KEYS
        assert done.stdout.count("\n") == 1
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert Session.load(session).complete

    def test_dialogue_summary_and_picture_are_written(self) -> None:
        result = call("run", "--seed", 3, "--max-seconds", 8)
        assert result.exit_code == 0, result.output
        assert Path("dorothie.png").read_bytes().startswith(b"\x89PNG")
        for text in ("millbrook", "seed 3", "Participant", "Instruct", "0 of its own making", "dorothie.png"):
            assert text in result.stdout
        assert max(map(len, result.stdout.splitlines())) <= 80

    def test_no_picture_option_draws_none(self) -> None:
        assert call("run", "--max-seconds", 1, "--no-picture").exit_code == 0
        assert not Path("dorothie.png").exists()

    def test_picture_shows_the_whole_town(self) -> None:
        pygame = pytest.importorskip("pygame")
        loaded("run", "--max-seconds", 1, "--json", "--picture", "p.png")
        assert pygame.image.load("p.png").get_size() == (1640, 900)

    def test_session_is_recorded_into_the_given_folder(self) -> None:
        facts = loaded("run", "--seed", 3, "--max-seconds", 12, "--json", "--out", "deep/down")
        session = Session.load(facts["session"])
        assert facts["session"] == str(Path("deep/down"))
        assert session.complete and session.header.seed == 3
        assert len(session.utterances()) == facts["utterances"] > 0
        assert len(session.all_moves) == facts["acts"]

    def test_word_errors_survive_replay_and_conversion(self) -> None:
        loaded("run", "--seed", 3, "--max-seconds", 60, "--word-errors", 0.3, "--out", "s", "--json")
        session = Session.load("s")
        assert session.header.config["word_error_rate"] == 0.3
        moves = session.moves()
        assert moves and any(move.recognised != move.text for move in moves)
        assert call("replay", "s", "--check").exit_code == 0
        assert call("convert", "s", "sdn", "--to", "sdn").exit_code == 0
        assert call("convert", "sdn", "back", "--to", "native").exit_code == 0
        heard = [(move.text, move.recognised) for move in Session.load("back").moves()]
        assert heard == [(move.text, move.recognised) for move in moves]

    def test_spoken_session_survives_replay_and_conversion(self) -> None:
        loaded("run", "--seed", 3, "--max-seconds", 25, "--speech", "--out", "s", "--json")
        session = Session.load("s")
        assert session.header.config["channel"] == "speech"
        assert len(session.audio) == len(session.all_moves) > 0
        assert call("replay", "s", "--check").exit_code == 0
        assert call("convert", "s", "sdn", "--to", "sdn").exit_code == 0
        assert len(list(Path("sdn/utterance").iterdir())) == len(session.utterances())
        result = call("run", "--speech", "--word-errors", 0.1)
        assert result.exit_code == 2 and "leave it out with --speech" in result.stderr

    def test_speech_without_its_extra_is_reported(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from dorothie_gym.support import optional_modules

        monkeypatch.setattr(optional_modules, "PACKAGES", ("no_such_voice",))
        result = call("run", "--speech")
        assert result.exit_code == 2
        assert f"speech needs no_such_voice: {pip_install('speech')}" in result.stderr

    def test_perception_by_the_camera_survives_replay(self) -> None:
        loaded("run", "--seed", 3, "--max-seconds", 30, "--perception", "camera", "--out", "s", "--json")
        assert Session.load("s").header.config["perception"] == "camera"
        assert call("replay", "s", "--check").exit_code == 0
        loaded("run", "--seed", 3, "--max-seconds", 30, "--out", "usual", "--json")
        assert "perception" not in Session.load("usual").header.config

    def test_silent_roles_do_nothing(self) -> None:
        silent = ("--participant", "silent", "--co-wizard", "silent", "--ad-wizard", "silent")
        facts = loaded("run", "--max-seconds", 5, "--json", *silent)
        assert facts["utterances"] == facts["acts"] == facts["physical_actions"] == facts["exceptions"] == 0

    def test_storyboard_and_town_can_be_chosen(self) -> None:
        facts = loaded("run", "--town", "brookside", "--storyboard", "poorly_cat", "--max-seconds", 1, "--json")
        assert (facts["town"], facts["storyboard"]) == ("brookside", "poorly_cat")

    @pytest.mark.long
    def test_video_has_ten_frames_per_second(self) -> None:
        ffmpeg = pytest.importorskip("imageio_ffmpeg")
        # In a process of its own: imageio-ffmpeg leaves pipes open, which is a warning here.
        done = process("run", "--seed", 3, "--max-seconds", 2, "--json", "--video", "v.mp4")
        assert done.returncode == 0 and done.stderr == ""
        frames, seconds = ffmpeg.count_frames_and_secs("v.mp4")
        assert frames == 21  # the beginning, and five for each of four decisions
        assert seconds == pytest.approx(2.1, abs=0.05)

    def test_video_without_its_extra_names_the_package_to_install(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("dorothie_gym.cli.output.find_spec", lambda name: None)
        result = call("run", "--video", "v.mp4")
        assert result.exit_code == 2 and pip_install("video") in result.stderr

    def test_ctrl_c_keeps_the_session_and_exits_with_130(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from dorothie_gym.session.session_engine import SessionEngine

        step = SessionEngine.step

        def interrupted(self: SessionEngine, actions: Any) -> Any:
            if self.session.world.time >= 3.0:
                raise KeyboardInterrupt
            return step(self, actions)

        monkeypatch.setattr(SessionEngine, "step", interrupted)
        result = call("run", "--seed", 3, "--out", "cut", "--json")
        assert result.exit_code == 130 and result.stdout == ""
        assert "Interrupted after 3.0 simulated seconds; the recording until then is in cut" in result.stderr
        session = Session.load("cut")
        assert not session.complete and session.duration == pytest.approx(3.0)


class TestTowns:
    def test_json_of_one_town_is_its_description(self) -> None:
        assert loaded("towns", "brookside", "--json") == describe(load_town("brookside"))

    def test_json_of_all_towns_is_a_list(self) -> None:
        rows = loaded("towns", "--json")
        assert {**describe(load_town("brookside")), "fold": "development"} in rows

    def test_towns_are_listed(self) -> None:
        result = call("towns")
        assert result.exit_code == 0 and "brookside" in result.stdout

    def test_town_is_described_and_drawn(self) -> None:
        result = call("towns", "brookside", "--picture", "map.png")
        assert result.exit_code == 0 and "Brook Road" in result.stdout and "map.png" in result.stdout
        assert Path("map.png").read_bytes().startswith(b"\x89PNG")

    @pytest.mark.parametrize("name", ["Town02", "Town05"])
    def test_published_map_is_described(self, name: str) -> None:
        path = ROOT.parent / "shared" / "maps" / f"{name}.xodr"
        if not path.is_file():
            pytest.skip(f"{path} is not there")
        assert loaded("towns", path, "--json")["name"] == name


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sessions")
    for seed in (3, 4):
        loaded("run", "--seed", seed, "--max-seconds", 30, "--json", "--out", folder / f"s{seed}")
    return folder


class TestEvaluate:
    @pytest.mark.parametrize("model", ["majority", "random"])
    def test_json_has_the_metrics_of_all_tasks(self, sessions: Path, model: str) -> None:
        table = loaded("evaluate", "--sessions", sessions, "--model", model, "--json")
        assert table["tasks"] == ["ufn", "rfn", "nfd"] and table["model"] == model
        assert table["corpus"]["sessions"] == {"s4": "all"}
        for key in ("ufn_move_accuracy", "rfn_slot_f1", "nfd_joint_accuracy", "nfd_joint_accuracy_paper"):
            assert table[key] == table["models"][model]["all"][key]["mean"]

    def test_trivial_baseline_is_written_and_scored_like_any_model(self, sessions: Path, tmp_path: Path) -> None:
        file = tmp_path / "random.parquet"
        drawn = loaded("evaluate", "--corpus", sessions, "--model", "random", "--seed", 5, "--save", file, "--json")
        read = loaded("evaluate", file, "--corpus", sessions, "--json")
        assert read["models"] == drawn["models"] and read["seed"] == 5
        assert read["about"][str(file)]["model"] == "random"

    def test_several_seeds_of_a_trivial_baseline_give_an_interval(self, sessions: Path) -> None:
        table = loaded("evaluate", "--corpus", sessions, "--model", "random", "--seed", 3, "--seeds", 2, "--json")
        figure = table["models"]["random"]["all"]["ufn_move_accuracy"]
        assert sorted(figure["values"]) == ["3", "4"] and figure["seeds"] == 2 and figure["half_width"] is not None
        assert "ufn_move_accuracy" not in table, "a single run only"

    def test_table_names_sessions_and_counts_points(self, sessions: Path) -> None:
        result = call("evaluate", "--sessions", sessions, "--tasks", "ufn,nfd")
        assert result.exit_code == 0
        assert "UfN" in result.stdout and "NfD" in result.stdout and "RfN, right of" not in result.stdout
        assert "points scored" in result.stdout and "flagged events" in result.stdout
        assert "split test, 1 sessions; divided: the first half of the sessions by name trains" in result.stdout

    def test_report_is_written(self, sessions: Path, tmp_path: Path) -> None:
        assert call("evaluate", "--corpus", sessions, "--out", tmp_path / "r").exit_code == 0
        assert (tmp_path / "r/table.md").read_text().startswith("# Results")
        assert (tmp_path / "r/confusion-majority.png").is_file()

    def test_default_corpus_is_used_without_sessions(self, monkeypatch: pytest.MonkeyPatch, sessions: Path) -> None:
        monkeypatch.setattr("dorothie_gym.evaluation.rollout.default_corpus", lambda: sessions)
        assert loaded("evaluate", "--json")["corpus"]["folder"] == str(sessions)

    def test_unwritable_cache_is_reported(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        (tmp_path / "file").touch()
        monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path / "file" / "below"))
        result = call("evaluate")
        assert result.exit_code == 2 and "set DOROTHIE_GYM_CACHE" in result.stderr


def test_storyboards_are_listed() -> None:
    names = [row["name"] for row in loaded("storyboards", "--json")]
    result = call("storyboards")
    assert len(names) >= 8 and all(name in result.stdout for name in names)


def test_version_is_printed() -> None:
    assert call("--version").stdout == f"dorothie-gym {dorothie_gym.__version__}\n"


def test_help_imports_nothing_slow() -> None:
    code = (
        "import sys; from typer.testing import CliRunner; from dorothie_gym.cli import app\n"
        "assert CliRunner().invoke(app, ['run', '--help']).exit_code == 0\n"
        "slow = {'scipy', 'numba', 'highway_env', 'pygame', 'matplotlib', 'filterpy', 'torch'} & set(sys.modules)\n"
        "assert not slow, slow"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment, timeout=60)
