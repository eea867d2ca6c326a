"""Ways of making a rollout look better than it was, each with the words by which its check reports it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import play
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player, find_player
from dorothie_gym.policies.ad_wizard import AdWizardConfig
from dorothie_gym.policies.persona import Persona
from dorothie_gym.session import session_engine
from dorothie_gym.session.recording import Event, EventType, Session
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.tasks import load_template, template_names
from tests.evaluation.closed_loop.rollout_edits import (
    CONFIG,
    LONGER,
    add_usage,
    change_header,
    change_record,
    change_session,
    cut,
    declare_error,
    drop_session,
    edit,
    edit_settings,
    end_of,
    measured_again,
    moved,
    no_end,
    no_end_line,
    repeat_session,
    reverse_rows,
    sessions_of,
    settings,
    swap_sessions,
    with_column,
    with_event,
    without_actions,
    without_actors,
)

# --- Played by cheats -------------------------------------------------------------------------------------------------


def play_as(folder: Path, patch: pytest.MonkeyPatch | None = None, *, named: Mapping[str, Any], **changes: Any) -> None:
    """Plays a session under other settings, and then writes those of the protocol into all files."""
    made = RolloutSettings(
        **{"cast": settings().cast, "towns": ("brookside",), "sessions": 1, "config": LONGER, **changes}
    )
    roll_out(made, folder)
    edit_settings(folder, lambda page: page.update(named))
    for path in sessions_of(folder):
        edit(path / "session.json", lambda page: page.update(config=LONGER.record()))
    if patch is not None:
        patch.undo()


def partner(role: Role, name: str) -> Callable[[Path, pytest.MonkeyPatch], None]:
    cast = {**settings().cast, role: find_player(name, role)}
    return lambda folder, _: play_as(folder, named={str(role): "scripted"}, cast=cast)


def configured(**fields: Any) -> Callable[[Path, pytest.MonkeyPatch], None]:
    config = replace(LONGER, **fields)
    return lambda folder, _: play_as(folder, named={"config": LONGER.record()}, config=config)


def late_ad_wizard(folder: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(AdWizardConfig, "__init__", _later(AdWizardConfig.__init__))
    play_as(folder, patch, named={})


def _later(init: Callable[..., None]) -> Callable[..., None]:
    def start(self: AdWizardConfig, **fields: Any) -> None:
        init(self, **{"first_at": 100.0, **fields})

    return start


def patient_personas(folder: Path, patch: pytest.MonkeyPatch) -> None:
    drawn = Persona.draw.__func__  # type: ignore[attr-defined]  # of a class method
    easy = classmethod(lambda cls, *rest: replace(drawn(cls, *rest), patience=1.0, knowledge=1.0))
    patch.setattr(Persona, "draw", easy)
    play_as(folder, patch, named={})


def hidden_personas(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Plays with drawn personas of its own, and writes the personas of the seed into the header."""
    patient_personas(folder, patch)
    roll_out(settings(sessions=1, config=LONGER), folder.parent / "other")
    personas = Session.load(sessions_of(folder.parent / "other")[0]).header.extra
    (path,) = sessions_of(folder)
    edit(path / "session.json", lambda page: page.update(personas))


def one_storyboard(folder: Path, patch: pytest.MonkeyPatch) -> None:
    template = load_template(template_names()[0])
    patch.setattr(session_engine, "draw_scenario", lambda town, _, *rest: draw_scenario(town, template, *rest))
    play_as(folder, patch, named={})


def other_seeds_for_partners(folder: Path, patch: pytest.MonkeyPatch) -> None:
    seed = play.policy_seed
    patch.setattr(play, "policy_seed", lambda number, *rest: seed(number + 1, *rest))
    play_as(folder, patch, named={})


def in_another_town(folder: Path, _: pytest.MonkeyPatch) -> None:
    play_as(folder, named={"towns": ["brookside"]}, towns=("millbrook",))
    (path,) = sessions_of(folder)
    path.rename(path.with_name("0000-brookside"))
    edit(path.with_name("0000-brookside") / "session.json", lambda page: page.update(town="brookside"))
    edit(folder / "rollout.json", lambda page: page["rows"][0].update(town="brookside"))


def of_another_seed(folder: Path, _: pytest.MonkeyPatch) -> None:
    play_as(folder, named={"seed": 0}, seed=1)
    wanted = settings().plans()[0].seed
    edit(sessions_of(folder)[0] / "session.json", lambda page: page.update(seed=wanted))
    edit(folder / "rollout.json", lambda page: page["rows"][0].update(seed=wanted))


def another_co_wizard(folder: Path, _: pytest.MonkeyPatch) -> None:
    cast = {**ALL_SCRIPTED, Role.CO_WIZARD: Player(name="random")}
    play_as(folder, named={"co_wizard": "lane-follow"}, cast=cast)


def played(**changes: Any) -> Callable[[Path, pytest.MonkeyPatch], None]:
    return lambda folder, _: play_as(folder, named={}, **changes)


# --- The list ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Tampering:
    """A way of cheating.

    Attributes:
        name: what is done, as in docs/leaderboard-checks.md.
        message: words of the fault that is reported.
        edits: changes the copy of an honest rollout, of `PROTOCOL`.
        plays: plays a rollout into a new folder, of `ONE`.
        quick: whether it belongs to the quick tests.
    """

    name: str
    message: str
    edits: Callable[[Path], object] | None = None
    plays: Callable[[Path, pytest.MonkeyPatch], object] | None = None
    quick: bool = False


def setting(**fields: Any) -> Callable[[Path], None]:
    return lambda folder: edit_settings(folder, lambda page: page.update(fields))


def append(name: str, text: str = "x") -> Callable[[Path], None]:
    """Adds a file to the folder, or to its first session."""

    def change(folder: Path) -> None:
        (folder / name.replace("SESSION", f"sessions/{sessions_of(folder)[0].name}")).write_text(text)

    return change


def first_move(session: Session) -> int:
    return next(k for k, event in enumerate(session.events) if event.type is EventType.DIALOGUE_MOVE)


def arrival(session: Session) -> Session:
    """The session with the arrival at its first subgoal."""
    row = session.header.subgoals[0]
    data = {
        "subgoal": 0,
        "landmark": session.header.landmarks[row["landmark"]]["name"],
        "status": "Complete",
        "cause": "arrival",
    }
    event = Event(frame=session.events[-1].frame - 15, type=EventType.SUBGOAL, source=Role.AGENT, data=data)
    return replace(session, events=(*session.events[:-1], event, session.events[-1]))


def first_landmark(session: Session) -> Session:
    """The session with one place hidden less, or more."""
    first, *others = session.header.landmarks
    first = {**first, "hidden": not first["hidden"]}
    return replace(session, header=replace(session.header, landmarks=(first, *others)))


def traits(session: Session) -> Session:
    personas = json.loads(json.dumps(session.header.extra["personas"]))
    personas["participant"]["patience"] = 1.0
    return replace(session, header=replace(session.header, extra={"personas": personas}))


def renamed_technical(session: Session) -> Session:
    return end_of(session, reason="technical")


PARTICIPANT, AD_WIZARD = Role.PARTICIPANT, Role.AD_WIZARD
AGAIN = "simulated again, it differs at"
DRAWN = "its header is not what its seed gives"

TAMPERINGS: tuple[Tampering, ...] = (
    # partners
    Tampering(name="silent Ad-Wizard renamed scripted", plays=partner(AD_WIZARD, "silent"), message=f"{AGAIN} frame",
              quick=True),
    Tampering(name="silent participant renamed scripted", plays=partner(PARTICIPANT, "silent"), message=DRAWN),
    Tampering(name="participant with chosen traits renamed scripted", message=DRAWN,
              plays=partner(PARTICIPANT, "scripted:knowledge=1..1,patience=1..1")),
    Tampering(name="Ad-Wizard whose tricks come later", plays=late_ad_wizard, message=f"{AGAIN} frame"),
    Tampering(name="personas drawn by patched code", plays=patient_personas, message=DRAWN, quick=True),
    Tampering(name="personas drawn by patched code, with those of the seed in the header", plays=hidden_personas,
              message=f"{AGAIN} frame"),
    Tampering(name="partners with other seeds", plays=other_seeds_for_partners, message=DRAWN),
    Tampering(name="persona edited in a header", edits=change_session(traits), message=DRAWN),
    Tampering(name="action of a partner removed", message=AGAIN,
              edits=change_session(lambda session: without_actions(session, PARTICIPANT))),
    # ends
    Tampering(name="line of the event End deleted", edits=no_end_line, message="is not complete", quick=True),
    Tampering(name="event End removed, counts adjusted", edits=no_end, message="has 0 events of type End", quick=True),
    Tampering(name="end called technical", edits=change_session(renamed_technical),
              message="ended for the reason 'technical'", quick=True),
    Tampering(name="end called technical in the outcome alone", message="its outcome another one",
              edits=change_session(lambda session: replace(session, summary={**(session.summary or {}),
                                                                             "reason": "technical"}))),
    Tampering(name="end called an arrival", message="ended by arrival, but not all subgoals were reached",
              edits=change_session(lambda session: end_of(session, reason="arrived"))),
    Tampering(name="record cut off", edits=change_session(lambda session: cut(session, 10.0)),
              message="ran out of time after 10 s; the time of the protocol is 15 s", quick=True),
    Tampering(name="record cut off, with its end at the limit", message="300 frames do not run to its end at 15 s",
              edits=change_session(lambda session: cut(session, 10.0, end=15.0))),
    Tampering(name="record cut off and called interrupted", message="holds no finished session",
              edits=change_session(lambda session: replace(cut(session, 10.0), summary=None, complete=False))),
    Tampering(name="shorter limit, written as that of the protocol", plays=configured(max_seconds=60.0),
              message="ran out of time after 60 s; the time of the protocol is 120 s", quick=True),
    Tampering(name="session called an error", edits=lambda folder: declare_error(folder, delete=True),
              message="ended in an error (ValueError: no); a submission has complete sessions only", quick=True),
    Tampering(name="finished session called an error", edits=lambda folder: declare_error(folder, delete=False),
              message="its row has an error, but the session is finished"),
    # world and record
    Tampering(name="no traffic, written as that of the protocol", message=f"{AGAIN} frame", quick=True,
              plays=configured(world=WorldConfig(vehicles=0, pedestrians=0))),
    Tampering(name="no word errors, written as those of the protocol", plays=configured(word_error_rate=0.0),
              message=f"{AGAIN} frame"),
    Tampering(name="more decisions a second", plays=configured(decision_frequency=5.0), message=DRAWN),
    Tampering(name="settings edited in a header", edits=change_header(config={**CONFIG.record(), "note": 1}),
              message="the session has other settings than the rollout"),
    Tampering(name="one storyboard for all sessions", plays=one_storyboard, message=DRAWN),
    Tampering(name="subgoals removed from a header", message=DRAWN,
              edits=change_session(lambda session: replace(
                  session, header=replace(session.header, subgoals=session.header.subgoals[-1:])))),
    Tampering(name="hidden place made known in a header", edits=change_session(first_landmark), message=DRAWN),
    Tampering(name="start moved in a header", edits=change_header(departure=(0, 1.0)), message=DRAWN),
    Tampering(name="further field of a header", edits=change_header(extra={"award": "best"}), message=DRAWN),
    Tampering(name="version edited in a header", edits=change_header(package_version="9.9"),
              message="was recorded by version 9.9"),
    Tampering(name="position of the car edited in a frame", edits=change_session(moved), message=f"{AGAIN} frame 2"),
    Tampering(name="other cars removed from the frames", edits=change_session(without_actors), message=AGAIN),
    Tampering(name="further column of the frames", edits=change_session(with_column), message=AGAIN),
    Tampering(name="frames of another session", message=AGAIN, edits=lambda folder: (
        shutil.copyfile(sessions_of(folder)[1] / "frames.parquet", sessions_of(folder)[0] / "frames.parquet"),
        measured_again(folder))),
    Tampering(name="event removed", message=AGAIN,
              edits=change_session(lambda session: with_event(session, first_move(session), None))),
    Tampering(name="further field of an event", message=AGAIN, edits=change_session(
        lambda session: with_event(session, 0, replace(session.events[0], extra={"note": "x"})))),
    Tampering(name="arrival invented", edits=change_session(arrival), message=AGAIN, quick=True),
    Tampering(name="success invented in the outcome", message=AGAIN,
              edits=change_session(lambda session: replace(session, summary={**(session.summary or {}),
                                                                             "success": True}))),
    Tampering(name="actions deleted", message="has no actions.jsonl",
              edits=lambda folder: (sessions_of(folder)[0] / "actions.jsonl").unlink()),
    Tampering(name="action that nobody can take", message="cannot be played again", plays=lambda folder, _: (
        play_as(folder, named={"co_wizard": "own/model"}),
        (sessions_of(folder)[0] / "actions.jsonl").write_text('{"frame":0,"co_wizard":{"fly":1}}\n'),
        measured_again(folder))),
    # which sessions
    Tampering(name="another seed, written as that of the protocol", plays=of_another_seed, message=DRAWN, quick=True),
    Tampering(name="another town, renamed", plays=in_another_town, message=DRAWN),
    Tampering(name="towns in another order", plays=played(towns=("northgate", "midtown", "millbrook")),
              message="towns are northgate, midtown, millbrook; the protocol has midtown, millbrook, northgate"),
    Tampering(name="more sessions than the protocol", plays=played(sessions=2),
              message="2 sessions; the protocol has 1"),
    Tampering(name="session left out", edits=drop_session, message="has no row", quick=True),
    Tampering(name="session in the place of another", edits=repeat_session, message=AGAIN),
    Tampering(name="sessions swapped", edits=swap_sessions, message="the session is of brookside, seed"),
    Tampering(name="folder renamed", message="is none of the planned sessions", edits=lambda folder:
              sessions_of(folder)[2].rename(folder / "sessions" / "0002-brookside-best")),
    Tampering(name="surplus session", message="is none of the planned sessions", edits=lambda folder:
              shutil.copytree(sessions_of(folder)[0], folder / "sessions" / "0009-brookside")),
    Tampering(name="row given twice", message="two rows have the same number", edits=lambda folder:
              edit(folder / "rollout.json", lambda page: page["rows"].append(page["rows"][0]))),
    Tampering(name="rows in another order, for another interval", edits=reverse_rows, message="another order"),
    # results
    Tampering(name="figure of a session edited", edits=change_record(success=True), quick=True,
              message="success is True; the session has False"),
    Tampering(name="time of a session edited", edits=change_record(seconds=1.0),
              message="seconds is 1.0; the session has"),
    Tampering(name="table edited", message="its tables are not those of its rows", quick=True, edits=lambda folder:
              edit(folder / "rollout.json", lambda page: page["success"].update(mean=1.0))),
    Tampering(name="table of a town edited", message="its tables are not those of its rows", edits=lambda folder: edit(
        folder / "rollout.json", lambda page: page["per_town"]["brookside"]["seconds"].update(low=1.0))),
    Tampering(name="further field of a row", message="fields that nothing checks", edits=lambda folder:
              edit(folder / "rollout.json", lambda page: page["rows"][0].update(award="best"))),
    Tampering(name="usage invented", edits=add_usage, message="usage.json: is no part of a session"),
    Tampering(name="usage of a partner invented", edits=lambda folder: add_usage(folder, PARTICIPANT),
              message="its row has a usage of participant"),
    # statements
    Tampering(name="random Co-Wizard renamed lane-follow", plays=another_co_wizard, quick=True,
              message=f"{AGAIN} frame"),
    Tampering(name="name of a model that the package does not have", edits=setting(co_wizard="pretrained:best"),
              message="there is no policy 'pretrained:best'"),
    Tampering(name="name of several lines", edits=setting(co_wizard="lane-follow\n| best"),
              message="a name has up to 200 printable characters"),
    Tampering(name="weights of a policy without any", edits=setting(sha256={"co_wizard": "a" * 64}),
              message="sha256 is not that of lane-follow"),
    Tampering(name="other weights of a shipped model", message="sha256 is not that of pretrained:ppo",
              edits=setting(co_wizard="pretrained:ppo", sha256={"co_wizard": "a" * 64})),
    Tampering(name="training cost of a policy without any", message="training is not that of lane-follow",
              edits=setting(training={"co_wizard": {"steps": 1, "seconds": 1.0}})),
    Tampering(name="weights of a partner", message="sha256 is {", edits=setting(
        co_wizard="own/model", sha256={"participant": "a" * 64})),
    Tampering(name="further field of the training cost", message="training, award: is unknown", edits=setting(
        co_wizard="own/model", training={"co_wizard": {"award": 1.0}})),
    Tampering(name="language model of a policy that asks none", message="own/model is no language model",
              edits=setting(co_wizard="own/model", language_models={"co_wizard": {}})),
    Tampering(name="further setting", edits=setting(award="best"), message="settings, award: is unknown"),
    Tampering(name="further field of settings.json", message="settings.json: award is unknown", edits=lambda folder:
              edit(folder / "settings.json", lambda page: page.update(award="best"))),
    Tampering(name="settings of the two files differ", message="rollout.json: seed is not that of settings.json",
              edits=lambda folder: edit(folder / "settings.json", lambda page: page.update(seed=7))),
    Tampering(name="version edited in settings.json", message="was played by package_version '9.9'",
              edits=lambda folder: edit(folder / "settings.json", lambda page: page.update(package_version="9.9"))),
    Tampering(name="unknown file of the rollout", edits=append("NOTES.md"), message="NOTES.md: is no part of a rollout",
              quick=True),
    Tampering(name="unknown file of a session", edits=append("SESSION/.award"), quick=True,
              message=".award: is no part of a session"),
)  # fmt: skip
"""Everything that was tried; docs/leaderboard-checks.md lists the names."""
