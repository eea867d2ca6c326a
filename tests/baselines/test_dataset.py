from pathlib import Path

import pytest

from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.encoders import text_encoder
from dorothie_gym.errors import SessionError
from tests.evaluation.teacher_forced.corpora import corpus


def test_objects_of_the_camera_make_another_dataset_of_the_same_corpus(tmp_path: Path) -> None:
    material = Dataset.load(corpus(tmp_path), "hashing")
    pictured = material.seeing("boxes")
    assert material.seeing("record") is material
    assert pictured is material.seeing("boxes") and pictured.columns.key != material.columns.key
    assert pictured.columns.sessions.names == material.columns.sessions.names


def test_dataset_without_a_corpus_cannot_draw_pictures(tmp_path: Path) -> None:
    alone = Dataset(Dataset.load(corpus(tmp_path), "hashing").columns, text_encoder("hashing"))
    with pytest.raises(SessionError, match="no corpus whose pictures"):
        alone.seeing("boxes")
