"""Note of the way that was asked for: shown at the seat of the Co-Wizard, from what was heard there alone."""

from __future__ import annotations

from dorothie_gym.lab.console.asked_steps import AskedSteps
from dorothie_gym.ontology import Role
from tests.lab.console.people import Person, Table

WAY = "Turn left, then take the next left, then stop."


def seated() -> tuple[Table, Person, Person]:
    table = Table("participant=human,co_wizard=human")
    participant, co_wizard = table.seat("participant"), table.seat("co_wizard")
    table.run(1.0)
    return table, participant, co_wizard


def test_steps_that_wait_are_shown_to_the_co_wizard_alone() -> None:
    table, participant, co_wizard = seated()
    assert co_wizard.state["asked"] == []
    participant.command("say", text="Hello car, and good morning.")
    table.run(4.0)
    assert co_wizard.state["asked"] == []
    participant.command("say", text=WAY)
    table.until(lambda: co_wizard.state["asked"])
    assert co_wizard.state["asked"] == ["left", "the next left", "stop"]
    assert "asked" not in participant.state


def test_another_way_takes_the_place_of_the_one_before() -> None:
    table, participant, co_wizard = seated()
    participant.command("say", text=WAY)
    table.until(lambda: co_wizard.state["asked"])
    participant.command("say", text="Turn around, and then take the next left.")
    table.until(lambda: len(co_wizard.state["asked"]) == 2)
    assert co_wizard.state["asked"] == ["turn around", "the next left"]


def test_next_session_begins_without_steps() -> None:
    table, participant, co_wizard = seated()
    participant.command("say", text=WAY)
    table.until(lambda: co_wizard.state["asked"])
    asked = table.room._frames.asked
    asked.begin(8)
    assert asked.words == []


def test_steps_are_done_where_the_road_is() -> None:
    table, participant, co_wizard = seated()
    participant.command("say", text=WAY)
    table.until(lambda: co_wizard.state["asked"])
    seen: list[list[str]] = []
    for tick in range(700):
        left = [angle for angle, *_ in co_wizard.state["exits"] if 40 < angle < 140]
        if left and tick % 10 == 0:
            co_wizard.command("drive", action="JTurn", angle=left[0])
        table.tick()
        if co_wizard.state["asked"] not in seen:
            seen.append(co_wizard.state["asked"])
    assert seen[:3] == [["left", "the next left", "stop"], ["the next left", "stop"], ["stop"]]


def test_memory_is_made_of_the_observation_of_the_co_wizard() -> None:
    """The same observations lead to the same note, whatever happens in the session."""
    table, participant, co_wizard = seated()
    other = AskedSteps(table.room.engine)
    other.begin(7)
    participant.command("say", text=WAY)
    for _ in range(80):
        table.tick()
        other.hear(table.room.engine.observations[Role.CO_WIZARD.value])
    assert other.words == co_wizard.state["asked"] != []
