"""Sessions by text: equal to those of the policy that asks a model, and robust against every kind of answer."""

from __future__ import annotations

import base64
import gc
import io
import json
import math
import random
import re
import weakref

import numpy as np
import pytest
from PIL import Image

from dorothie_gym.agents import TextSession, merged_page
from dorothie_gym.errors import AgentSessionError
from dorothie_gym.evaluation.tiers import ROUGH
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import CameraConfig, EnvConfig
from tests.agents.players import Idler, play, reader_of
from tests.policies.language_model.sessions import NOWHERE, PromptModel
from tests.policies.language_model.sessions import play as play_by_policy

SHORT = EnvConfig(max_seconds=90.0)
MINUTE = EnvConfig(max_seconds=60.0)


@pytest.fixture(scope="module")
def session() -> TextSession:
    return TextSession(config=MINUTE)


# --- Equal sessions ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pages", ["full", "changes"])
@pytest.mark.parametrize("role", AGENT_ROLES)
def test_equal_answers_give_the_session_of_the_policy(role: Role, pages: str) -> None:
    session, model = TextSession(role, "brookside", config=SHORT, pages=pages), PromptModel(reader_of(role))
    answered: list[str] = []
    turn = session.reset(4)
    summary = play_by_policy({role: (NOWHERE, model)}, seed=4, config=SHORT)
    for prompt, answer in model.asked:
        assert not turn.done and not turn.error
        if pages == "full":
            assert turn.page == prompt.text and turn.system == prompt.system
        assert turn.schema == prompt.schema.json_schema()
        answered.append(turn.page)
        turn = session.answer(answer)
    assert turn.done
    usage = summary.pop("usage")[str(role)]
    assert session.engine.summary() == summary
    outcome = session.finish()
    assert (outcome.turns, outcome.expired, outcome.faults) == (usage["calls"], usage["expired"], 0)
    assert outcome.characters == sum(map(len, [turn.system, *answered, turn.page]))


def test_seed_and_answers_determine_the_session(session: TextSession) -> None:
    first, again = (play(session, reader_of("co_wizard"), 8) for _ in range(2))
    assert first == again


def test_reward_is_that_of_the_role_and_adds_up(session: TextSession) -> None:
    turn = session.reset(3)
    total = turn.reward
    while not turn.done:
        turn = session.answer(Idler()(turn))
        total += turn.reward
    assert session.finish().reward == pytest.approx(total) == pytest.approx(-0.3)  # 0.005 a second


@pytest.mark.long
def test_pages_of_changes_are_short_and_sufficient() -> None:
    whole = play(TextSession(town="brookside"), reader_of("co_wizard"), 3)
    changes = play(TextSession(town="brookside", pages="changes"), reader_of("co_wizard"), 3)
    assert (changes.success, changes.turns, changes.seconds) == (whole.success, whole.turns, whole.seconds)
    assert changes.characters < 0.5 * whole.characters
    assert changes.characters / 4 <= 12_000  # tokens of a whole session


def _without_far_distances(page: str) -> set[str]:
    """Lines of a page; those of places without their distances, those of things in sight with their names only."""
    return {re.sub(r"\d+ m (away|by the route)(, (ahead|behind|to the \w+))?", "", line) for line in page.splitlines()}


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_page_after_changes_is_the_whole_page_but_for_distances_of_places_and_things(role: Role) -> None:
    whole, changes = (TextSession(role, config=SHORT, pages=pages) for pages in ("full", "changes"))
    one, other, page = whole.reset(5), changes.reset(5), ""
    reader = reader_of(role)
    while not one.done:
        page = merged_page(page, other.page) if page else other.page
        assert _without_far_distances(one.page) <= _without_far_distances(page)
        answer = reader(one.page)
        one, other = whole.answer(answer), changes.answer(answer)


def test_pages_of_faults_and_tools_do_not_become_part_of_the_page() -> None:
    session = TextSession(config=MINUTE, pages="changes")
    page = session.reset(5).page
    for turn in (session.answer("no"), session.tool("say", value="Hello."), session.tool("fly")):
        assert merged_page(page, turn.page) == page


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_schema_of_a_role_is_the_same_in_all_turns_and_begins_with_a_thought(role: Role) -> None:
    session, found = TextSession(role, config=MINUTE), set()
    turn = session.reset(5)
    while not turn.done:
        found.add(json.dumps(session.schema))
        assert list(session.schema["properties"]) == list(turn.schema["properties"])  # type: ignore[arg-type, call-overload]
        turn = session.answer({"again": "5"})
    (schema,) = map(json.loads, found)
    assert next(iter(schema["properties"])) == "thought"
    for name, choices in session.reset(5).choices.items():
        spec = schema["properties"][name]
        assert spec.get("enum", list(choices)) == list(choices)
        assert "enum" in spec or "page" in spec["description"] or "choices under" in spec["description"]


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_thoughts_and_their_absence_change_nothing(role: Role) -> None:
    session, reader = TextSession(role, "brookside", config=MINUTE), reader_of(role)
    plain = play(session, reader, 6)
    reader = reader_of(role)
    assert play(session, lambda page: {"thought": "The passenger hears nothing of this.", **reader(page)}, 6) == plain


def test_turn_has_the_picture_of_the_camera_if_the_session_has_one() -> None:
    session = TextSession(config=EnvConfig(max_seconds=5.0, camera=CameraConfig(width=96, height=64)))
    turn = session.reset(3)
    while not turn.done:
        address = turn.picture
        assert address.startswith("data:image/png;base64,")
        pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2]))))
        assert np.array_equal(pixels, session.engine.observations["co_wizard"]["camera"])
        turn = session.answer({"again": "1"})
    assert not turn.picture and not TextSession(config=MINUTE).reset(3).picture


# --- Tools ------------------------------------------------------------------------------------------------------------


def test_tools_give_the_session_of_the_answers_that_they_fill(session: TextSession) -> None:
    answers = [{"goal": "none", "say": "Where to?", "again": "5"}, {"drive": "none", "note": "ask again", "again": "3"}]
    session.reset(7)
    expected = [session.answer({"note": "", **answer}).page for answer in answers]
    session.reset(7)
    names = {"goal": "set_goal", "say": "say", "drive": "drive", "note": "note"}
    for answer, page in zip(answers, expected, strict=True):
        for field, name in names.items():
            if field in answer:
                turn = session.tool(name, value=answer[field])
                assert "Noted" in turn.page and not turn.error and turn.time == session.engine.session.world.time
        assert session.tool("look").page
        assert session.tool("wait", seconds=float(answer["again"]) + 0.4).page == page
    assert "Your note: ask again" in session.tool("look").page
    assert "Your note: ask again" in session.tool("wait").page  # a note stays until it is replaced


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_tools_of_a_role_fill_all_fields_and_have_schemas(role: Role) -> None:
    session = TextSession(role, config=MINUTE)
    fields = {spec.field for spec in session.tools() if spec.field}
    turn = session.reset(1)
    assert fields == set(turn.schema["properties"]) - {"again", "thought"}  # type: ignore[arg-type]
    for spec in session.tools():
        function = spec.function()["function"]
        assert json.loads(json.dumps(function)) == function
    assert session.tools() == session.tools()


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("fly", {}, "there is no tool 'fly'; the tools are say, drive"),
        ("drive", {"value": "Fly"}, "it must be one of"),
        ("drive", {}, "needs the argument value"),
        ("drive", {"speed": 3}, "has no argument 'speed'"),
        ("look", {"at": "sky"}, "it has no argument"),
        ("wait", {"seconds": math.nan}, "must be a number of seconds"),
        ("wait", {"seconds": "soon"}, "must be a number of seconds"),
        ("wait", {"seconds": 10**400}, "must be a number of seconds"),
        ("say", {"value": 5}, "it must be a text"),
        ("say", {"value": "x" * 10**6}, "at most 20000 characters"),
        ("", {}, "there is no tool"),
        ("drive", {"name": "Stop"}, "has no argument 'name'"),
        ("drive", {"self": "Stop"}, "has no argument 'self'"),
    ],
)
def test_wrong_call_of_a_tool_is_words_and_takes_no_time(
    session: TextSession, name: str, arguments: dict[str, object], words: str
) -> None:
    begun = session.reset(2)
    turn = session.tool(name, **arguments)
    assert words in turn.error and turn.error in turn.page and "\n" not in turn.error
    assert (turn.time, turn.done, turn.choices) == (begun.time, False, begun.choices)


# --- Faults from outside ----------------------------------------------------------------------------------------------

_DEEP: dict[str, object] = {}
_DEEP["drive"] = _DEEP
WRONG: tuple[object, ...] = (
    "", "{}", "[]", "null", "Turn left.", '{"drive": "Fly"}', '{"fly": 1}', '{"drive": NaN}', '{"say": 1e999}',
    "[" * 9999, '{"drive": ' * 3000,
    "\x00", "\ud800", "x" * 10**6, {"drive": math.nan}, {"say": math.inf}, {"drive": ["Stop"]},
    {1: 2}, {("a",): 1}, {"drive": object()}, _DEEP, {"say": "x" * 10**6}, None, 7, math.nan, b"{}", ["drive"],
)  # fmt: skip


@pytest.mark.parametrize("number", range(len(WRONG)))
def test_wrong_answer_is_words_and_takes_no_time(session: TextSession, number: int) -> None:
    begun = session.reset(2)
    turn = session.answer(WRONG[number])  # type: ignore[arg-type]
    assert turn.error and "\n" not in turn.error and len(turn.error) < 2000
    assert (turn.time, turn.done, turn.schema) == (begun.time, False, begun.schema)
    assert not session.answer({"say": "Hello."}).error  # the session goes on


def test_ten_thousand_malformed_answers_end_the_session_at_the_limit_of_faults(session: TextSession) -> None:
    draw, turn = random.Random(0), session.reset(2)
    for number in range(10_000):
        turn = session.answer("".join(draw.choices('{}[]":,drive Stop\\\n', k=draw.randrange(30))))
        assert turn.error
        assert turn.done == (number >= session.max_faults - 1)
    outcome = session.finish()
    assert turn.truncated and (outcome.faults, outcome.turns, outcome.score) == (20, 20, 0.0)
    assert outcome.reason == "unfinished"


def test_limit_of_turns_ends_a_session(session: TextSession) -> None:
    limited = TextSession(config=MINUTE, max_turns=3)
    turn = limited.reset(2)
    for _ in range(3):
        assert not turn.done
        turn = limited.answer({"again": "1"})
    assert turn.done and turn.truncated and "after 3 turns" in turn.page


@pytest.mark.parametrize(("name", "arguments"), [("look", {}), ("say", {"value": "Hello."}), ("fly", {})])
def test_calls_that_take_no_time_count_for_the_limit_of_turns(name: str, arguments: dict[str, object]) -> None:
    limited = TextSession(config=MINUTE, max_turns=3)
    limited.reset(2)
    turns = [limited.tool(name, **arguments) for _ in range(4)]
    assert [turn.done for turn in turns] == [False, False, True, True]
    assert turns[-1].truncated and limited.finish().turns == 3


def test_ad_wizard_is_told_why_its_change_was_refused() -> None:
    session = TextSession(Role.AD_WIZARD, "brookside")
    session.reset(7)
    turn = session.answer({"change": "message", "again": "20"})
    assert 'Your change "message" was refused: the message is empty.' in turn.page and turn.time < 5.0
    turn = session.answer({"change": "message", "message": "Mind the road.", "again": "20"})
    assert "was refused" not in turn.page
    assert session.engine.session.messages[-1][1] == "Mind the road."


def test_use_before_reset_is_an_error_in_words() -> None:
    session = TextSession(config=MINUTE)
    for call in (lambda: session.answer("{}"), lambda: session.tool("look"), session.finish):
        with pytest.raises(AgentSessionError, match=r"call reset\(\) first"):
            call()


def test_use_after_the_end_is_words_and_changes_nothing(session: TextSession) -> None:
    session.reset(2)
    session.answer({"say": "Hello."})
    outcome = session.finish()
    for turn in (session.answer({"say": "Bye."}), session.tool("wait")):
        assert turn.done and "over" in turn.error and turn.choices == {} and turn.schema == {}
    assert session.finish() == outcome
    assert not session.reset(2).done


@pytest.mark.parametrize("seed", [-1, 1.5, math.nan, "7", None, True])
def test_wrong_seed_is_refused(session: TextSession, seed: object) -> None:
    with pytest.raises(ValueError, match="seed is .*; it must be a whole number"):
        session.reset(seed)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"role": "driver"}, "role is 'driver'; it must be one of participant"),
        ({"pages": "short"}, "pages is 'short'; it must be one of full, changes"),
        ({"max_turns": 0}, "max_turns is 0"),
        ({"max_faults": 1.5}, "max_faults is 1.5"),
        ({"quiet_time": math.nan}, "quiet_time is nan; it must be in 1..3600"),
        ({"quiet_time": "10"}, "quiet_time is '10'"),
        (
            {"partners": {"participant": None}},
            "partners has None for participant; it must be a policy or the name of one",
        ),
        ({"partners": {"co_wizard": "silent"}}, "partners has 'co_wizard'; the others are"),
        ({"partners": {"participant": "shy"}}, "there is no policy 'shy'"),
    ],
)
def test_wrong_settings_are_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        TextSession(**arguments)  # type: ignore[arg-type]


def test_scenario_is_played_in_place_of_the_seed(session: TextSession) -> None:
    session.reset(11)
    scenario, page = session.engine.scenario, session.tool("look").page
    assert session.reset(5, scenario).page == page
    with pytest.raises(ValueError, match="scenario is a str"):
        session.reset(5, "town")  # type: ignore[arg-type]


def test_partners_are_policies_by_name_or_object() -> None:
    named = TextSession(config=MINUTE, partners={"participant": "silent", "ad_wizard": "silent"})
    limits = named.engine.limits
    given = TextSession(config=MINUTE, partners={role: make_policy("silent", role, limits)
                                                 for role in (Role.PARTICIPANT, Role.AD_WIZARD)})  # fmt: skip
    pages = [list(_pages(session)) for session in (named, given)]
    assert pages[0] == pages[1]
    assert not any("passenger said" in page for page in pages[0])


def _pages(session: TextSession) -> list[str]:
    turn, pages = session.reset(3), list[str]()
    while not turn.done:
        pages.append(turn.page)
        turn = session.answer({"again": "10"})
    return pages


def test_dropped_sessions_leave_nothing_behind() -> None:
    dropped = []
    for seed in range(4):
        session = TextSession(config=MINUTE)
        session.reset(seed)
        dropped.append(weakref.ref(session))
    del session
    gc.collect()
    assert [each() for each in dropped] == [None] * 4


def test_tier_gives_town_settings_and_partners() -> None:
    rough = TextSession("participant", tier="rough")
    assert (rough.engine.town.name, rough.engine.config) == (ROUGH.town, ROUGH.config)
    assert TextSession("participant", "brookside", tier="rough").engine.town.name == "brookside"
    with pytest.raises(ValueError, match="rough"):
        TextSession(tier="rouhg")
