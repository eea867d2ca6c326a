"""Kinds of files that users provide: a sound original of each, and what the package does with it."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from tests.malformed.map_pieces import make_at_hand, make_ends, make_left, make_written
from tests.malformed.map_use import use_map
from tests.malformed.side_files import (
    make_annotations,
    make_cassette,
    make_study,
    read_annotations,
    read_cassette,
    read_study,
)
from tests.maps import opendrive_text as xodr
from tests.maps.yaml_text import MIDTOWN
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl import Training


@dataclass(frozen=True)
class Subject:
    """Kind of files.

    Attributes:
        make: writes a sound original into an empty folder.
        read: reads what is in the folder, and uses it.
        slow: whether a reading takes more than some hundredths of a second.
    """

    make: Callable[[Path], object]
    read: Callable[[Path], object]
    slow: bool = False


# --- Sessions, corpora, predictions ----------------------------------------------------------------------------------


def _release(folder: Path) -> None:
    from tests.archive.sdn.builders import release

    release(folder / "one")


def _sample(folder: Path) -> None:
    from tests.archive.sdn.builders import sample

    sample(folder / "one")


def _hub(folder: Path) -> None:
    from tests.archive.sdn.builders import hub

    hub(folder / "one")


def _native(folder: Path) -> None:
    from dorothie_gym.ontology import Role
    from dorothie_gym.session.recording import SeatEvent, SeatEventKind, SeatLogWriter
    from tests.session.recording.test_scene import record

    write(folder / "one", talk(), config={"world": {"vehicles": 3}, "rewards": {"time": -0.1}, "max_seconds": 60.0})
    record(folder / "two", finish=True)
    with SeatLogWriter(folder / "two") as log:
        log.append(SeatEvent(frame=3, kind=SeatEventKind.JOINED, role=Role.CO_WIZARD, data={"seconds": None}))
        log.append(SeatEvent(frame=9, kind=SeatEventKind.PAUSED, data={"reason": "absence"}))


def _read_sessions(folder: Path) -> None:
    from dorothie_gym.archive import Corpus
    from dorothie_gym.errors import DorothieGymError
    from dorothie_gym.evaluation.analysis.transcript import transcript_lines
    from dorothie_gym.evaluation.teacher_forced import labels_of
    from dorothie_gym.evaluation.teacher_forced.features import columns_of
    from dorothie_gym.session.recording import Session, read_seat_log

    labels_of(folder, "all")
    for entry in Corpus.load(folder).entries:
        try:
            session = entry.load()
            read_seat_log(entry.path)
        except DorothieGymError:
            continue
        session.check()
        columns_of(session)
        transcript_lines(session)
        _replay_config(session)
        saved = session.save(folder / ".saved" / entry.name)
        assert Session.load(saved).events == session.events


def _replay_config(session: object) -> None:
    from dorothie_gym.errors import SessionError
    from dorothie_gym.evaluation.rollout.replay import config_of
    from dorothie_gym.session.recording import Session

    assert isinstance(session, Session)
    try:
        config_of(session.header)
    except SessionError as error:
        check_message(error)


def _corpus(folder: Path) -> None:
    from dorothie_gym.archive import Corpus
    from tests.evaluation.teacher_forced.corpora import corpus

    Corpus.load(corpus(folder / "corpus", ("train", "test/seen"))).write_manifest()


def _read_corpus(folder: Path) -> None:
    from dorothie_gym.archive import Corpus

    corpus = Corpus.load(folder / "corpus")
    corpus.verify()
    corpus.filter(exception="task")
    corpus.filter(town="crossing")


def _predictions(folder: Path) -> None:
    from dorothie_gym.evaluation.teacher_forced import labels_of, write_predictions
    from tests.evaluation.teacher_forced.corpora import corpus, oracle

    labels = labels_of(corpus(folder / ".corpus", ("test/seen",)), "all")
    write_predictions(folder / "p.parquet", oracle(labels), about={"encoder": "hashing", "sizes": [1, 2]})


def _read_predictions(folder: Path) -> None:
    from dorothie_gym.evaluation.teacher_forced import evaluate_predictions, labels_of, read_about, read_predictions

    path = folder / "p.parquet"
    about = {str(path): read_about(path)}
    evaluate_predictions(read_predictions(path), labels_of(folder / ".corpus", "all"), about=about).to_json()


# --- Towns and storyboards -------------------------------------------------------------------------------------------


def _yaml_town(folder: Path) -> None:
    (folder / "midtown.yaml").write_text(MIDTOWN)


def _opendrive_town(folder: Path) -> None:
    profile = '<elevation s="0" a="1" b="0.01" c="0" d="0"/>'
    signals = '<signals><signal s="90" t="-4" id="7" type="1000001" dynamic="yes" orientation="+"/></signals>'
    crossing = '<objects><object type="crosswalk" id="3" s="50" t="0" length="3" width="8" hdg="0"/></objects>'
    plan = xodr.geometry("<line/>", 60.0) + xodr.geometry('<arc curvature="0.01"/>', 40.0, s=60.0, x=60.0)
    onward = '<successor elementType="road" elementId="2" contactPoint="start"/>'
    sections = xodr.section(
        0.0, xodr.lane(1), xodr.lane(-1, more=xodr.linked(after=-1)), xodr.lane(-2, kind="sidewalk")
    )
    second = (
        xodr.geometry('<spiral curvStart="0" curvEnd="0.02"/>', 30.0, x=98.9, y=7.9, hdg=0.4)
        + xodr.geometry('<poly3 a="0" b="0" c="0.001" d="0"/>', 20.0, s=30.0, x=127.0, y=22.0, hdg=0.7)
        + xodr.geometry(
            '<paramPoly3 aU="0" bU="20" cU="0" dU="0" aV="0" bV="0" cV="1" dV="0"/>', 20.0, s=50.0, x=142.0, y=35.0
        )
    )
    text = xodr.opendrive(
        xodr.road(1, plan=plan, sections=sections, link=onward, profile=profile, more=signals + crossing),
        xodr.road(2, length=70.0, plan=second, offset='<laneOffset s="0" a="0.1" b="0" c="0" d="0"/>'),
        '<junction id="5"><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection></junction>',
    )
    (folder / "town.xodr").write_text(text)


def _read_town(folder: Path) -> None:
    from dorothie_gym.maps import describe, load_town
    from dorothie_gym.maps.lint import check_town
    from dorothie_gym.sim.network.network import TownNetwork
    from dorothie_gym.sim.state.town_arrays import town_arrays

    for path in sorted(folder.iterdir()):
        town = load_town(path)
        describe(town)
        check_town(town)
        town_arrays(TownNetwork(town))


def _use_maps(folder: Path) -> None:
    for path in sorted(folder.iterdir()):
        use_map(path, Random(path.stat().st_size if path.is_file() else 0))


def _storyboard(folder: Path) -> None:
    from dorothie_gym.tasks import parsing

    text = (Path(parsing.__file__).parent / "data/storyboards/low_battery.json").read_text()
    (folder / "errand.json").write_text(json.dumps(parsing.read_json(text, "errand")))


def _read_storyboard(folder: Path) -> None:
    from dorothie_gym.maps import load_town
    from dorothie_gym.tasks import bind, load_template

    for path in sorted(folder.iterdir()):
        bind(load_template(path), load_town("brookside").sites, np.random.default_rng(0))


# --- Rollouts --------------------------------------------------------------------------------------------------------


def _rollout(folder: Path) -> None:
    from dorothie_gym import __version__
    from dorothie_gym.evaluation.closed_loop import RolloutResult, RolloutRow, RolloutSettings
    from dorothie_gym.evaluation.closed_loop.session_record import MetException
    from dorothie_gym.ontology import ExceptionKind, Role
    from dorothie_gym.policies import ALL_SCRIPTED, Player
    from dorothie_gym.session.recording import FORMAT_VERSION
    from tests.evaluation.closed_loop.drives import record

    player = Player(name="ppo", training={"steps": 50_000, "seconds": 1200.0})
    made = RolloutSettings(cast={**ALL_SCRIPTED, Role.CO_WIZARD: player}, sessions=3)
    met = MetException(kind=ExceptionKind.WEATHER, met=3.0, seconds=4.5)
    rows = (
        RolloutRow(number=0, town="brookside", seed=3, record=record(exceptions=(met,), infractions={"vehicle": 1})),
        RolloutRow(number=1, town="brookside", seed=4, record=record(success=False, completion=None)),
        RolloutRow(number=2, town="brookside", seed=5, error="RuntimeError: faint"),
    )
    (folder / "rollout.json").write_text(json.dumps(RolloutResult(settings=made.to_json(), rows=rows).to_json()))
    (folder / "settings.json").write_text(
        json.dumps({"package_version": __version__, "format_version": FORMAT_VERSION, "sessions_planned": 3})
    )
    (folder / "cost.json").write_text('{"wall_seconds": 100.0, "cpu_seconds": 180.0, "workers": 2}')


def _read_rollout(folder: Path) -> None:
    from rich.console import Console

    from dorothie_gym.evaluation.closed_loop.leaderboard import leaderboard_page, read_entries
    from dorothie_gym.evaluation.closed_loop.results import print_result
    from dorothie_gym.evaluation.rollout.folder import locked_folder

    entries = read_entries([folder])
    leaderboard_page(entries)
    for entry in entries:
        assert all(0.0 <= (figure["mean"] or 0.0) < 1e12 for figure in entry.table.figures.values())
        print_result(entry.result, Console(file=io.StringIO()))
    with locked_folder(folder, "settings.json", {"sessions_planned": 3}):
        pass


# --- Models ----------------------------------------------------------------------------------------------------------


def _rl_model(folder: Path) -> None:
    from dorothie_gym.baselines.rl.checkpoint import make_model, save_model
    from dorothie_gym.baselines.rl.environments import make_env
    from dorothie_gym.baselines.rl.settings import NAVIGATION, tuned_settings

    given = {"max_seconds": 10.0, "traffic": "none", "guidance": "turns", "town": "brookside"}
    settings = tuned_settings("maskable_ppo", NAVIGATION, env_settings=given, network=(8,))
    save_model(make_model(settings, make_env(NAVIGATION, given)), settings, folder / "rl", 12.0)


def _ad_wizard_model(folder: Path) -> None:
    from dorothie_gym.baselines.rl.checkpoint import make_model, save_model
    from dorothie_gym.baselines.rl.environments import make_env
    from dorothie_gym.baselines.rl.settings import tuned_settings

    name, given = "dorothie_gym/AdWizard-v0", {"town": "brookside", "partners": {"co_wizard": "silent"}}
    settings = tuned_settings("maskable_ppo", name, env_settings=given, network=(8,))
    save_model(make_model(settings, make_env(name, given)), settings, folder / "ad-wizard", 9.0)


def _unfinished_run(folder: Path) -> None:
    from dorothie_gym.baselines.rl.resumption import CHECKPOINT

    training = _training(folder / "run")
    training.run()
    for path in training.folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        elif path.name != CHECKPOINT:
            path.unlink()


def _resume_run(folder: Path) -> None:
    _training(folder / "run")._vector.close()


def _training(folder: Path) -> Training:
    from dorothie_gym.baselines.rl import Training, TrainingSettings

    settings = TrainingSettings(
        algorithm="ppo", env="CartPole-v1", steps=64, environments=2, evaluate_every=32, episodes=1, network=(8,),
        parameters={"n_steps": 16, "batch_size": 32, "n_epochs": 1},
    )  # fmt: skip
    return Training(settings, folder)


def _co_wizard_model(folder: Path) -> None:
    from dorothie_gym.baselines.roles.co_wizard.files import FILES

    form = (
        '{"content":null,"meaning":[["goal",0,[["place",["from","goal"]]]]],"move":"Acknowledge",'
        '"slots":[["from","goal"]],"wording":{"topic":["text","taken"]}}'
    )
    vocabulary = ("", form)
    network = FILES.network(len(vocabulary))
    FILES.save(network, folder / "co-wizard", vocabulary=vocabulary, steps=3, seconds=1.0, settings={"seed": 0})


def _participant_model(folder: Path) -> None:
    from dorothie_gym.baselines.roles.participant.files import FILES

    form = (
        '{"content":null,"meaning":[["goal",0,[["place",["from","goal"]]]]],"move":"Instruct",'
        '"slots":[["from","goal"]],"wording":{"topic":["text","goal"]}}'
    )
    vocabulary = ("", "stop", form)
    network = FILES.network(len(vocabulary))
    FILES.save(network, folder / "participant", vocabulary=vocabulary, steps=3, seconds=1.0, settings={"seed": 0})


def _benchmark_model(folder: Path) -> None:
    import torch

    from dorothie_gym.baselines.checkpoints import ModelCard, save, sha256_of
    from dorothie_gym.baselines.encoders import text_encoder
    from dorothie_gym.baselines.toto import TOTOConfig

    path, encoder = folder / "benchmark", text_encoder("hashing")
    save(path / "best.safetensors", torch.nn.Linear(800, 800), {"seed": 0})
    ModelCard(
        row="toto", config=TOTOConfig.small().to_json(), corpus="0" * 64, encoder="hashing", encoder_id=encoder.id,
        spread=1.5, merges=((1, 2), (3, 4)), weights="best.safetensors",
        weights_sha256=sha256_of(path / "best.safetensors"), steps=100, seconds=3.0,
    ).write(path)  # fmt: skip


def _read_models(role: str, folder: Path) -> None:
    from dorothie_gym.ontology import Role
    from dorothie_gym.policies import find_player
    from dorothie_gym.session.spaces import SpaceLimits

    for path in sorted(folder.iterdir()):
        find_player(str(path), Role(role)).make(Role(role), SpaceLimits())


_read_co_wizards, _read_participants, _read_ad_wizards = (
    partial(_read_models, role) for role in ("co_wizard", "participant", "ad_wizard")
)


# --- Caches, with correct checksums ----------------------------------------------------------------------------------


def _cache(folder: Path) -> None:
    from dorothie_gym.evaluation.teacher_forced.features import columns_of
    from dorothie_gym.evaluation.teacher_forced.features.corpus_columns import write_columns
    from dorothie_gym.maps import load_town
    from dorothie_gym.maps.cache import pack
    from tests.session.recording.test_scene import record

    with np.load(io.BytesIO(pack(load_town("brookside"), "key"))) as archive:
        (folder / "document.json").write_bytes(archive["document"].tobytes())
        np.save(folder / "floats.npy", archive["floats"])
    (folder / "columns").mkdir()
    write_columns(columns_of(record(folder / ".session", finish=True)), folder / "columns")
    text = (folder / "columns/columns.json").read_text().partition("\n")[2]
    (folder / "columns/columns.json").write_text(text)


def _read_cache(folder: Path) -> None:
    import hashlib

    from dorothie_gym.archive import Task
    from dorothie_gym.errors import DorothieGymError
    from dorothie_gym.evaluation.teacher_forced.features import points
    from dorothie_gym.evaluation.teacher_forced.features.corpus_columns import read_columns

    try:
        _unpack(folder)
    except DorothieGymError as error:
        check_message(error)
    index = folder / "columns/columns.json"
    try:
        page = json.loads(index.read_bytes())
        files = sorted((folder / "columns").glob("*.npy"))
        page["files"] = {path.stem: hashlib.sha256(path.read_bytes()).hexdigest() for path in files if path.is_file()}
        text = json.dumps(page).encode()
    except (ValueError, TypeError, OSError):
        text = index.read_bytes() if index.is_file() else b""
    if not index.is_dir():
        index.write_bytes(hashlib.sha256(text).hexdigest().encode() + b"\n" + text + b"\n")
    columns = read_columns(folder / "columns")
    for task in Task:
        points(columns, task)


def _unpack(folder: Path) -> None:
    import hashlib
    import zipfile

    from dorothie_gym.maps import describe
    from dorothie_gym.maps.cache import unpack
    from dorothie_gym.sim.network.network import TownNetwork
    from dorothie_gym.sim.state.town_arrays import town_arrays

    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in ("document", "floats"):
            member = io.BytesIO()
            path = folder / ("document.json" if name == "document" else "floats.npy")
            content = path.read_bytes() if path.is_file() else b""
            if name == "document":
                np.save(member, np.frombuffer(content, np.uint8))
                content = member.getvalue()
            archive.writestr(f"{name}.npy", content)
        archive.comment = bytes(64)
    body = buffer.getvalue()[:-64]
    town = unpack(body + hashlib.sha256(body).hexdigest().encode(), "key")
    describe(town)
    town_arrays(TownNetwork(town))


def _audio(folder: Path) -> None:
    from dorothie_gym.support.audio import encode_flac

    tone = np.sin(np.arange(4000) * 0.2).astype(np.float32)
    (folder / "speech.flac").write_bytes(encode_flac(tone))


def _read_audio(folder: Path) -> None:
    from dorothie_gym.support.audio import read_audio

    read_audio(folder / "speech.flac")


SUBJECTS: Final = MappingProxyType(
    {
        "audio": Subject(_audio, _read_audio),
        "native": Subject(_native, _read_sessions),
        "release": Subject(_release, _read_sessions),
        "sample": Subject(_sample, _read_sessions),
        "hub": Subject(_hub, _read_sessions),
        "annotations": Subject(make_annotations, read_annotations),
        "corpus": Subject(_corpus, _read_corpus),
        "predictions": Subject(_predictions, _read_predictions),
        "yaml": Subject(_yaml_town, _read_town, slow=True),
        "opendrive": Subject(_opendrive_town, _read_town),
        "map-written": Subject(make_written, _use_maps, slow=True),
        "map-left": Subject(make_left, _use_maps, slow=True),
        "map-ends": Subject(make_ends, _use_maps, slow=True),
        "map-at-hand": Subject(make_at_hand, _use_maps, slow=True),
        "storyboard": Subject(_storyboard, _read_storyboard),
        "study": Subject(make_study, read_study),
        "rollout": Subject(_rollout, _read_rollout),
        "cassette": Subject(make_cassette, read_cassette),
        "cache": Subject(_cache, _read_cache),
        "rl": Subject(_rl_model, _read_co_wizards, slow=True),
        "ad-wizard": Subject(_ad_wizard_model, _read_ad_wizards, slow=True),
        "co-wizard": Subject(_co_wizard_model, _read_co_wizards, slow=True),
        "participant": Subject(_participant_model, _read_participants, slow=True),
        "run": Subject(_unfinished_run, _resume_run, slow=True),
        "benchmark": Subject(_benchmark_model, _read_co_wizards),
    }
)
"""Kinds by name; folders and files that begin with a dot are not mutated."""


def check_message(error: Exception) -> None:
    """Raises `AssertionError` unless an error has a message of one line that can be read at once."""
    text = str(error)
    assert text and "\n" not in text.strip("\n") and len(text) < 1500, (
        f"message of {type(error).__name__}: {text[:2000]!r}"
    )
