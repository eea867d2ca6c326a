"""Speakers differ by their personas, and their moods follow what happens."""

from collections import Counter

import numpy as np
import pytest

from dorothie_gym.dialogue import draw_style
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import DialogueMove, Role
from dorothie_gym.policies import ScriptedParticipant, find_player
from dorothie_gym.policies.co_wizard.config import CoWizardStyle
from dorothie_gym.policies.mood import HALF_LIFE, Happening, Mood
from dorothie_gym.policies.participant.config import ParticipantStyle
from dorothie_gym.policies.persona import SHARES, Directions, Driving, Persona, parse_traits
from dorothie_gym.policies.speech import SpeechState, remark
from dorothie_gym.session.spaces import SpaceLimits
from tests.policies.test_repairs import Human

SEEDS = range(400)


def drawn(given: str = "") -> list[Persona]:
    traits = parse_traits(given) if given else None
    return [Persona.draw(np.random.default_rng(seed), traits) for seed in SEEDS]


def test_personas_differ_in_every_trait():
    people = drawn()
    for name in SHARES:
        values = [getattr(persona, name) for persona in people]
        assert min(values) < 0.1 and max(values) > 0.9 and np.mean(values) == pytest.approx(0.5, abs=0.05)
    assert {persona.directions for persona in people} == set(Directions)
    assert {persona.driving for persona in people} == set(Driving)


def test_voices_of_personas_differ_and_can_be_given():
    pitches = [persona.pitch for persona in drawn()]
    assert min(pitches) < 0.87 and max(pitches) > 0.96 and np.mean(pitches) == pytest.approx(0.915, abs=0.01)
    assert {persona.pitch for persona in drawn("pitch=0.9")} == {0.9}
    with pytest.raises(ValueError, match=r"pitch is '1.2'.*0.86..0.97"):
        parse_traits("pitch=1.2")


def test_given_traits_hold_and_leave_the_others_alone():
    for free, fixed in zip(drawn(), drawn("talkativeness=0.8..1,directions=vague,patience=0.2"), strict=True):
        assert 0.8 <= fixed.talkativeness <= 1.0 and fixed.patience == 0.2 and fixed.directions is Directions.VAGUE
        assert (fixed.humour, fixed.pace, fixed.driving) == (free.humour, free.pace, free.driving)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("tallness=1", "no trait 'tallness'"),
        ("patience=2", "0..1"),
        ("patience=0.9..0.1", "0..1"),
        ("directions=east", "turns, landmarks, streets, compass, vague"),
        ("patience", "0..1"),
    ],
)
def test_wrong_traits_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        parse_traits(given)
    with pytest.raises(PolicyLoadError, match=message):
        find_player(f"scripted:{given}", Role.PARTICIPANT)


def test_traits_are_given_by_the_name_of_the_policy():
    town = load_town("brookside")
    policy = find_player("scripted:humour=1,directions=landmarks", Role.PARTICIPANT).make(
        Role.PARTICIPANT, SpaceLimits.for_town(town)
    )
    persona = policy.persona_of(policy.initial_state(3, town))
    assert persona is not None and persona["humour"] == 1.0 and persona["directions"] == "landmarks"


def test_persona_follows_from_the_seed():
    town = load_town("brookside")
    personas = [ScriptedParticipant().initial_state(seed, town).persona for seed in (1, 1, 2)]
    assert personas[0] == personas[1] != personas[2]


def mean(trait: str, given: str, of=ParticipantStyle) -> float:
    return float(np.mean([getattr(of.of(each, np.random.default_rng(7)), trait) for each in drawn(given)]))


@pytest.mark.parametrize(
    ("of", "trait", "less", "more"),
    [
        (ParticipantStyle, "chat", "talkativeness=1,humour=1", "talkativeness=0,humour=0"),
        (ParticipantStyle, "patience", "patience=0", "patience=1"),
        (ParticipantStyle, "names_street", "knowledge=0", "knowledge=1"),
        (ParticipantStyle, "aligns", "certainty=1", "certainty=0"),
        (ParticipantStyle, "reasons", "directions=vague", "directions=landmarks"),
        (CoWizardStyle, "silent", "talkativeness=1", "talkativeness=0"),
        (CoWizardStyle, "checks", "certainty=1", "certainty=0"),
        (CoWizardStyle, "pace", "driving=gentle", "driving=brisk"),
    ],
)
def test_style_follows_from_the_persona(of, trait, less, more):
    assert mean(trait, less, of) < mean(trait, more, of)


@pytest.mark.parametrize("of", [ParticipantStyle, CoWizardStyle])
def test_inattentive_persona_notices_nothing(of):
    assert mean("notices", "attention=0..0.05", of) == 0.0 < mean("notices", "attention=0.1..0.2", of)


def test_politeness_gives_the_register_and_keeps_its_shares():
    found = Counter(
        draw_style(Role.PARTICIPANT, np.random.default_rng(seed), persona.leanings).register
        for seed, persona in enumerate(drawn())
    )
    assert found[Register.PLAIN] / len(SEEDS) == pytest.approx(0.4, abs=0.08)
    polite = draw_style(Role.PARTICIPANT, np.random.default_rng(1), Persona(politeness=0.95).leanings)
    blunt = draw_style(Role.PARTICIPANT, np.random.default_rng(1), Persona(politeness=0.05).leanings)
    assert (polite.register, blunt.register) == (Register.POLITE, Register.BLUNT)
    assert polite.indirectness > blunt.indirectness and polite.idiolect == blunt.idiolect


# --- mood -------------------------------------------------------------------------------------------------------------


def test_stress_makes_impatient_and_calms_down():
    style = ParticipantStyle.of(Persona(), np.random.default_rng(0))
    upset = Mood().after(Happening.MISSED, 10.0).after(Happening.WRONG_WAY, 20.0)
    assert style.in_mood(upset).patience < style.patience
    assert style.in_mood(upset).nods < style.nods
    calmer = upset.after(Happening.RED_LIGHT, 20.0 + 5 * HALF_LIFE)
    assert calmer.stress < upset.stress and abs(calmer.trust - 0.5) < abs(upset.trust - 0.5)


def test_mistrust_makes_the_car_check_more_and_the_participant_guide_more():
    betrayed = Mood().after(Happening.WRONG_WAY, 0.0).after(Happening.MISSED, 1.0)
    assert betrayed.trust < 0.5
    car = CoWizardStyle.of(Persona(), np.random.default_rng(0))
    assert car.in_mood(betrayed).checks > car.checks
    human = ParticipantStyle.of(Persona(), np.random.default_rng(0))
    assert human.in_mood(betrayed).guides > human.guides


def test_certain_and_impossible_traits_keep_their_chance():
    upset = Mood().after(Happening.MISSED, 0.0)
    for chance in (0.0, 1.0):
        assert upset.rarer(chance) == upset.likelier_without_trust(chance) == upset.likelier_in_hurry(chance) == chance


def test_misunderstanding_is_felt():
    human = Human()
    human.hears(DialogueMove.ACKNOWLEDGE, human.another_place())
    assert human.state.mood.stress > 0.0 and human.state.mood.trust < 0.5


# --- timing -----------------------------------------------------------------------------------------------------------


def replies(persona: Persona, count: int = 300) -> list[float]:
    """Times from the other's last word, which is a quarter of a second ago, to the own first one [s]."""
    found = []
    for seed in range(count):
        rng, now = np.random.default_rng(seed), 10.0
        speech = SpeechState(role=Role.PARTICIPANT, delivery=persona.delivery).plan(remark(DialogueMove.ACKNOWLEDGE))
        speech = speech.heard_other(now, (), rng, 0.25)
        said = None
        while said is None:
            said, speech = speech.speak(now, 0.0, rng)
            now += 0.5
        found.append(now - 0.5 + said.onset - 9.75)
    return found


def test_gaps_before_replies_are_skewed_and_differ_between_speakers():
    quick, slow = replies(Persona(gap=0.15)), replies(Persona(gap=0.8))
    assert np.median(quick) < 0.4 < np.median(slow) < 1.0
    assert np.mean(slow) > np.median(slow)
    assert max(slow) > 1.5


def test_slow_speakers_take_longer_and_short_turns_are_slower():
    slow, fast = Persona(pace=0.9).delivery, Persona(pace=1.2).delivery
    text = "turn left at the next junction please"
    assert slow.seconds(text) > fast.seconds(text)
    assert slow.pace_of("left") < slow.pace_of(text)
