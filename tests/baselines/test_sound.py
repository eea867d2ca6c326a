"""Sound as an input of models: encoders, inputs at points, and training on a spoken corpus."""

from __future__ import annotations

import importlib.util
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

torch = pytest.importorskip("torch", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.dataset import Dataset  # noqa: E402
from dorothie_gym.baselines.encoders import (  # noqa: E402
    HubertEncoder,
    SoundReader,
    SpeechEmbeddingEncoder,
    SpeechEncoder,
    mel_table,
)
from dorothie_gym.baselines.encoders.sound import log_mel  # noqa: E402
from dorothie_gym.baselines.experiment import Experiment, run_experiment  # noqa: E402
from dorothie_gym.baselines.model_entries import find_row  # noqa: E402
from dorothie_gym.baselines.model_zoo import make_model  # noqa: E402
from dorothie_gym.baselines.point_tensors import UFN  # noqa: E402
from dorothie_gym.baselines.toto import TOTOConfig  # noqa: E402
from dorothie_gym.errors import EncoderError, SessionError  # noqa: E402
from dorothie_gym.speech import find_synthesizer, say  # noqa: E402
from tests.session.recording.spoken import spoken_session  # noqa: E402


def tone(frequency: float, seconds: float = 1.0) -> NDArray[np.float32]:
    return (0.3 * np.sin(2 * np.pi * frequency * np.arange(round(16000 * seconds)) / 16000)).astype(np.float32)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound") / "corpus"
    for seed, fold in enumerate(("train", "val/seen", "test/seen"), start=5):
        (folder / fold).mkdir(parents=True)
        spoken_session(folder / fold / f"seed_{seed}", seed, seconds=30.0)
    return folder


@pytest.fixture(scope="module")
def hubert(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tiny HuBERT with random weights, as a user would have one in a folder."""
    transformers = pytest.importorskip("transformers")
    torch.manual_seed(3)
    config = transformers.HubertConfig(
        hidden_size=16, num_hidden_layers=1, num_attention_heads=2, intermediate_size=16, conv_dim=(8, 8, 8),
        conv_stride=(5, 4, 4), conv_kernel=(10, 8, 4), num_feat_extract_layers=3, num_conv_pos_embeddings=4,
        num_conv_pos_embedding_groups=2,
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("hubert") / "weights"
    transformers.HubertModel(config).save_pretrained(folder)
    assert (folder / "model.safetensors").is_file()
    return folder


def test_tones_are_in_the_bands_of_their_frequencies() -> None:
    sweep = np.concatenate([tone(300.0), tone(3000.0)])
    levels = log_mel(sweep)
    assert levels.shape == (99, 32) and np.abs(levels.mean(axis=0)).max() < 1e-3
    first, second = levels[:45].mean(axis=0), levels[55:].mean(axis=0)
    assert first.argmax() < 10 < 18 < second.argmax()
    noise = np.random.default_rng(2).standard_normal(16000).astype(np.float32) * np.float32(0.1)
    assert np.abs(log_mel(np.float32(0.5) * noise) - log_mel(noise)).max() < 0.1, "loudness is no feature"


def test_spectra_are_cut_and_filled_with_zeros() -> None:
    noise = np.random.default_rng(2).standard_normal(320000).astype(np.float32)
    table = mel_table([noise[:8000], np.empty(0, np.float32), noise])
    assert table.shape == (3, 256, 32) and table.dtype == np.float16
    assert table[0, :24].any(axis=1).all() and not table[0, 24:].any() and not table[1].any()
    assert table[2].any(axis=1).all()


def test_reader_ignores_the_silence_behind_an_utterance() -> None:
    torch.manual_seed(0)
    reader = SoundReader(24, dropout=0.0).eval()
    spectra = torch.from_numpy(mel_table([np.random.default_rng(1).standard_normal(16000).astype(np.float32)]))
    vectors = reader(spectra)
    assert vectors.shape == (1, 24)
    assert torch.allclose(vectors, reader(spectra[:, :64]), atol=1e-3)
    assert not torch.allclose(vectors, reader(spectra.flip(1)), atol=1e-2)


def test_frozen_encoders_tell_words_apart_and_repeat_themselves(hubert: Path) -> None:
    words = ("left", "the second right", "stop here please")
    sounds = [say(find_synthesizer(), text) for text in words] + [np.empty(0, np.float32)]
    encoders: list[SpeechEncoder] = [HubertEncoder(hubert)]
    if importlib.util.find_spec("pyopen_wakeword") is not None:
        encoders.append(SpeechEmbeddingEncoder())
    for encoder in encoders:
        vectors = encoder.encode(sounds)
        assert vectors.shape == (4, encoder.dim) and vectors.dtype == np.float32 and np.isfinite(vectors).all()
        assert not vectors[3].any()
        assert np.array_equal(encoder.encode(sounds[1:]), vectors[1:]), "no earlier sound is remembered"
        assert all(np.abs(vectors[a] - vectors[b]).max() > 1e-3 for a, b in ((0, 1), (1, 2), (0, 2)))


@pytest.mark.long
def test_points_of_the_participant_have_the_sound_of_their_utterance(corpus: Path) -> None:
    material = Dataset.load(corpus, "hashing")
    spec = TOTOConfig.small().spec
    examples = material.examples("test", spec, sound="log-mel")
    sound, task = examples.inputs["current_sound"], examples.labels.task
    assert sound.shape[1:] == (256, 32)
    assert bool((sound[task == UFN] != 0).flatten(1).any(1).all()) and not bool((sound[task != UFN] != 0).any())
    current = examples.inputs["current_text"]
    for text in torch.unique(current[task == UFN]).tolist():
        same = sound[(task == UFN) & (current == text)]
        assert (same == same[0]).all(), "spans of an utterance share its sound, as its words"


@pytest.mark.long
def test_models_of_sound_train_and_others_need_what_they_name(corpus: Path, hubert: Path, tmp_path: Path) -> None:
    material = Dataset.load(corpus, "hashing")
    job = Experiment(corpus=corpus, encoder="hashing", model="sound", size="small", seed=0, out=tmp_path)
    result = run_experiment(job, material)
    assert result["sound"] == "log-mel-1-256x32" and int(str(result["points"])) > 3
    again = run_experiment(replace(job, out=tmp_path / "again"), material)
    assert again["validation"] == result["validation"]
    with pytest.raises(EncoderError, match="give --hubert"):
        make_model(find_row("sound-hubert"), "small", Dataset.load(corpus, "hashing"), 0)
    material.hubert = hubert
    model = make_model(find_row("sound-hubert"), "small", material, 0)
    assert model.config.sound_width == 16
    inputs, labels = material.examples("test", model.spec, sound="hubert").take(torch.arange(4))
    assert torch.isfinite(model.loss(inputs, labels))
    with pytest.raises(EncoderError, match="holds no HubertModel"):
        HubertEncoder(tmp_path)


def test_corpus_without_audio_is_refused(corpus: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(corpus, tmp_path / "silent", ignore=shutil.ignore_patterns("*.flac"))
    with pytest.raises(SessionError, match="has no audio; generate it with --speech"):
        Dataset.load(copy, "hashing").examples("test", TOTOConfig.small().spec, sound="log-mel")
