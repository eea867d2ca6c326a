"""Noise in the car."""

import numpy as np
import pytest

from dorothie_gym.session.dialogue_channel import CabinState, noise_level, noise_levels, signal_to_noise
from dorothie_gym.speech import cabin_noise, mixed
from dorothie_gym.speech.cabin_noise import active_rms


def test_noise_grows_with_speed_rain_wind_and_talk() -> None:
    quiet = CabinState(speed=10.0)
    for louder in (
        CabinState(speed=20.0),
        CabinState(speed=10.0, rain=50.0),
        CabinState(speed=10.0, wind=80.0),
        CabinState(speed=10.0, talkers=3),
    ):
        assert noise_level(louder) > noise_level(quiet)
        assert signal_to_noise(louder) < signal_to_noise(quiet)


def test_levels_follow_their_laws_of_growth() -> None:
    slow, fast = (noise_levels(CabinState(speed=speed)) for speed in (10.0, 20.0))
    assert fast["road"] - slow["road"] == pytest.approx(30 * np.log10(2))
    assert fast["air"] - slow["air"] == pytest.approx(60 * np.log10(2))
    heavy, light = (noise_levels(CabinState(rain=rain))["rain"] for rain in (100.0, 50.0))
    assert heavy - light == pytest.approx(3.0, abs=0.02)


def test_ratios_lie_between_those_of_a_parked_car_and_a_motorway_in_the_rain() -> None:
    assert 18.0 < signal_to_noise(CabinState()) < 26.0
    assert 5.0 < signal_to_noise(CabinState(speed=33.0, rain=100.0)) < 14.0


def test_noise_of_a_seed_is_the_same_and_most_of_it_is_low() -> None:
    state = CabinState(speed=14.0)
    first, again = (cabin_noise(state, 16000, np.random.default_rng(5)) for _ in range(2))
    assert np.array_equal(first, again)
    power = np.square(np.abs(np.fft.rfft(first)))
    assert power[:500].sum() > 10 * power[2000:].sum()  # below 500 Hz, above 2 kHz


@pytest.mark.parametrize("ratio", [20.0, 5.0])
def test_speech_and_noise_have_the_wanted_ratio(ratio: float) -> None:
    rng = np.random.default_rng(1)
    speech = np.zeros(16000, np.float32)
    speech[4000:12000] = 0.05 * rng.standard_normal(8000)  # pauses do not count
    noise = cabin_noise(CabinState(speed=14.0), 16000, rng)
    added = mixed(speech, noise, ratio) - speech
    assert 20 * np.log10(active_rms(speech) / active_rms(added)) == pytest.approx(ratio, abs=1.0)


def test_loud_mixtures_are_scaled_and_not_clipped() -> None:
    speech = np.full(16000, 0.9, np.float32) * np.sign(np.sin(np.arange(16000) * 0.4)).astype(np.float32)
    result = mixed(speech, cabin_noise(CabinState(), 16000, np.random.default_rng(0)), 0.0)
    assert np.abs(result).max() == pytest.approx(1.0)
    assert np.count_nonzero(np.abs(result) > 0.999) < 10


@pytest.mark.parametrize("values", [{"speed": -1.0}, {"rain": 101.0}, {"wind": -1.0}, {"talkers": -1}])
def test_states_out_of_range_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"CabinState.{next(iter(values))} is"):
        CabinState(**values)
