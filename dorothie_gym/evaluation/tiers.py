"""Tiers of the benchmark: conditions of sessions, from the usual ones to those that leave room above.

A tier is a set of settings, each of which is also an option of its own. docs/tiers.md has the reasons and measurements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from dorothie_gym.errors import did_you_mean
from dorothie_gym.maps.folds import DEFAULT_TOWN, DEVELOPMENT_TOWNS, SEEN_TOWNS, UNSEEN_TOWNS
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.sim.config import AutomaticBraking, WorldConfig
from dorothie_gym.support.copying import shared
from dorothie_gym.tasks.briefs import TalkFamily
from dorothie_gym.tasks.storyboard_specification import StoryboardSource

HELD_OUT_PERSONAS: Final = ("scripted:talkativeness=0.8..1", "scripted:certainty=0..0.2")
"""Participants with traits that no learned role has met in training (`learned_role.dagger_sessions.TRAINED`)."""

POOL_SEPARATOR: Final = "+"
"""Separator of the names of players who take turns."""

POOL: Final = (*HELD_OUT_PERSONAS, "pretrained:participant")
"""Participants who take turns; a language model is added with `--participant`."""


@shared
@dataclass(frozen=True, kw_only=True)
class Tier:
    """Conditions of sessions.

    Attributes:
        name: name of the tier.
        config: settings of the sessions: acts, words, channel, time, storyboards, stops, traffic and braking.
        participants: players of the participant, who take turns, as for `policy_loader.find_player`.
        ad_wizard: player of the Ad-Wizard.
        towns: towns, which take turns.
        town: town of environments and single sessions that name none.
        oracle_player: player of the Co-Wizard that is the oracle.
    """

    name: str
    config: EnvConfig
    participants: tuple[str, ...]
    ad_wizard: str
    towns: tuple[str, ...]
    town: str = DEFAULT_TOWN
    oracle_player: str = "scripted"

    @property
    def oracle(self) -> EnvConfig:
        """Settings of the oracle's sessions, which show that the tier can be done.

        Words arrive exactly and with their acts, and the brakes act on all bodies in the world. Scenarios, traffic,
        partners, time and actions are those of the tier.
        """
        world = replace(self.config.world, braking=AutomaticBraking.COMPLETE)
        return replace(self.config, observe_acts=True, word_error_rate=0.0, channel=ChannelKind.TEXT, world=world)

    def partners(self, role: str) -> dict[str, str]:
        """Returns the policies of the other roles in an environment of one role: the first of each."""
        usual = {"participant": self.participants[0], "co_wizard": "scripted", "ad_wizard": self.ad_wizard}
        return {name: player for name, player in usual.items() if name != role}


_SHIPPED: Final = (*SEEN_TOWNS, *DEVELOPMENT_TOWNS)

_CROWDED: Final = WorldConfig(vehicles=60, pedestrians=40, density=12.0, braking=AutomaticBraking.PERCEIVED)

_HARD_AD_WIZARD: Final = "scripted:rate=4,spacing=12,roadblock_time=240,bad_weather_time=140..240"

_LONGEST: Final = 3600.0  # bound of the time that depends on the reference [s]

STANDARD: Final = Tier(
    name="standard",
    config=EnvConfig(observe_acts=False, word_error_rate=0.05),
    participants=("scripted",),
    ad_wizard="scripted",
    towns=_SHIPPED,
)
"""The usual session, without the acts of what was heard."""

EARS: Final = Tier(
    name="ears",
    config=EnvConfig(observe_acts=False, word_error_rate=0.2, time_factor=2.5, max_seconds=_LONGEST),
    participants=HELD_OUT_PERSONAS,
    ad_wizard="scripted",
    towns=_SHIPPED,
)
"""Poor recognition, held-out personas, and a time that depends on the scenario."""

ROUGH: Final = Tier(
    name="rough",
    config=EnvConfig(
        observe_acts=False, word_error_rate=0.35, time_factor=2.0, stops=(4, 6), max_seconds=_LONGEST, world=_CROWDED
    ),
    participants=POOL,
    ad_wizard=_HARD_AD_WIZARD,
    towns=_SHIPPED,
)
"""Worse recognition, crowded streets in which the car hits what it does not perceive, and more trouble on the way."""

STRANGERS: Final = Tier(
    name="strangers",
    config=EnvConfig(
        observe_acts=False,
        word_error_rate=0.0,
        channel=ChannelKind.SPEECH,
        time_factor=2.0,
        stops=(4, 6),
        storyboards=StoryboardSource.GENERATED,
        max_seconds=_LONGEST,
        world=_CROWDED,
    ),
    participants=POOL,
    ad_wizard=_HARD_AD_WIZARD,
    towns=UNSEEN_TOWNS,
    town=UNSEEN_TOWNS[0],
)
"""Spoken words and generated storyboards, in generated towns that nothing was trained in; `--towns` adds maps."""


def _talk_tier(family: TalkFamily) -> Tier:
    """Returns the tier of a family of talk tasks: exact words without acts, and a minute."""
    return Tier(
        name=str(family),
        config=EnvConfig(observe_acts=False, word_error_rate=0.0, max_seconds=60.0, talk=family),
        participants=("client",),
        ad_wizard="street-closer",
        towns=_SHIPPED,
        oracle_player="talk-oracle",
    )


ASK_FIRST: Final = _talk_tier(TalkFamily.ASK_FIRST)
"""Requests of which some must be settled before anything is done."""

ADMIT_IT: Final = _talk_tier(TalkFamily.ADMIT_IT)
"""Requests of which some cannot or must not be fulfilled."""

TIERS: Final[Mapping[str, Tier]] = MappingProxyType(
    {tier.name: tier for tier in (STANDARD, EARS, ROUGH, STRANGERS, ASK_FIRST, ADMIT_IT)}
)
"""All tiers by name: those of driving from the easiest, and those of talk."""


def find_tier(name: str) -> Tier:
    """Returns the tier with a name.

    Raises:
        ValueError: there is no such tier; lists them.
    """
    if name not in TIERS:
        raise ValueError(f"tier is {name!r}; {did_you_mean(name, TIERS)}the tiers are {', '.join(TIERS)}")
    return TIERS[name]
