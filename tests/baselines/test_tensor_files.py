"""Files of weights: whatever is wrong with one, the message names the file, the tensor, and what was expected."""

from __future__ import annotations

import json
import math
import shutil
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import pytest
import torch
from torch import nn

from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.rl.checkpoint import load_model
from dorothie_gym.baselines.roles.co_wizard.files import FILES
from dorothie_gym.baselines.tensor_files import read_header, read_tensors, save_tensors
from dorothie_gym.errors import DorothieGymError, InputFileError

NAME: Final = "weights"


@dataclass
class Parts:
    """Content of a file: entries of the header without their places, and the numbers behind it, by tensor."""

    entries: dict[str, dict[str, Any]]
    numbers: dict[str, bytes]
    metadata: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, content: bytes) -> Parts:
        (length,) = struct.unpack_from("<Q", content)
        header, data = json.loads(content[8 : 8 + length]), content[8 + length :]
        metadata = header.pop("__metadata__", {})
        return cls(header, {name: data[slice(*entry["data_offsets"])] for name, entry in header.items()}, metadata)

    def header(self) -> dict[str, Any]:
        """Returns the header, with the tensors one behind the other."""
        found, at = {}, 0
        for name, entry in self.entries.items():
            end = at + len(self.numbers[name])
            found[name] = {**entry, "data_offsets": [at, end]}
            at = end
        return {"__metadata__": self.metadata, **found} if self.metadata else found

    def file(self, header: object = None) -> bytes:
        """Returns the file, with another header if one is given."""
        text = json.dumps(self.header() if header is None else header).encode()
        return struct.pack("<Q", len(text)) + text + b"".join(self.numbers.values())

    def matrix(self) -> str:
        """Returns the name of a tensor with two axes of different sizes."""
        shapes = {name: entry["shape"] for name, entry in self.entries.items()}
        return next(name for name, shape in shapes.items() if len(shape) == 2 and shape[0] != shape[1])

    def retyped(self, dtype: str, size: int) -> Parts:
        """Returns the file with zeros of another type in the matrix."""
        name = self.matrix()
        entries = {**self.entries, name: {**self.entries[name], "dtype": dtype}}
        zeros = bytes(size * math.prod(self.entries[name]["shape"]))
        return Parts(entries, {**self.numbers, name: zeros}, self.metadata)

    def placed(self, **changes: object) -> bytes:
        """Returns the file with another shape or place of the matrix in the header."""
        header = self.header()
        header[self.matrix()].update(changes)
        return self.file(header)


def _surplus(parts: Parts, name: str) -> bytes:
    entries = {**parts.entries, name: {"dtype": "F32", "shape": [2]}}
    return Parts(entries, {**parts.numbers, name: bytes(8)}, parts.metadata).file()


def _missing(parts: Parts) -> bytes:
    name = parts.matrix()
    entries = {key: entry for key, entry in parts.entries.items() if key != name}
    return Parts(entries, {key: parts.numbers[key] for key in entries}, parts.metadata).file()


def _not_finite(parts: Parts) -> bytes:
    found = parts.retyped("F32", 4)
    found.numbers[found.matrix()] = struct.pack("<f", math.nan) + found.numbers[found.matrix()][4:]
    return found.file()


def _twice(parts: Parts) -> bytes:
    text = json.dumps(parts.header())
    again = json.dumps({parts.matrix(): parts.header()[parts.matrix()]})
    header = f"{text[:-1]}, {again[1:]}".encode()
    return struct.pack("<Q", len(header)) + header + b"".join(parts.numbers.values())


Damage = Callable[[Parts], bytes]

WRONG_FILES: Final[Mapping[str, tuple[Damage, str]]] = MappingProxyType(
    {
        "header longer than any file": (
            lambda parts: struct.pack("<Q", 2**60) + parts.file()[8:],
            f"its header takes {2**60} bytes, and the file",
        ),
        "nothing but an absurd length": (lambda parts: struct.pack("<Q", 2**60), f"its header takes {2**60} bytes"),
        "header without an end": (lambda parts: parts.file()[:40], "and the file has 32 for it"),
        "empty": (lambda parts: b"", "its header takes 0 bytes, and the file has 0 for it"),
        "header that is no JSON": (
            lambda parts: struct.pack("<Q", 4) + b"nope" + parts.file()[8:],
            "header, column 1: not JSON",
        ),
        "header that is a list": (lambda parts: parts.file([1, 2]), "its header is no JSON object"),
        "header that is no text": (lambda parts: struct.pack("<Q", 2) + b"\xff\xfe", "its header is no text"),
        "cut numbers": (lambda parts: parts.file()[:-2], "is it cut off?"),
        "more numbers": (lambda parts: parts.file() + b"more", "bytes behind its header; expected"),
    }
)
"""Damage of a whole file, and what the message says."""

WRONG_TENSORS: Final[Mapping[str, tuple[Damage, str]]] = MappingProxyType(
    {
        "shape beyond all memory": (lambda parts: parts.placed(shape=[2**40, 2**40]), "bytes; expected"),
        "shape with a negative size": (lambda parts: parts.placed(shape=[-1, 2]), "field 'shape[0]'"),
        "place behind the end": (lambda parts: parts.placed(data_offsets=[0, 10**12]), "has 1000000000000 bytes"),
        "no place": (
            lambda parts: parts.file({**parts.header(), parts.matrix(): {"dtype": "F32", "shape": [1]}}),
            "missing required field `data_offsets`",
        ),
        "two tensors in one place": (
            lambda parts: parts.file({**parts.header(), parts.matrix() + "b": parts.header()[parts.matrix()]}),
            "where the one before it ends",
        ),
        "given twice": (_twice, "is given twice"),
        "type that nobody knows": (lambda parts: parts.retyped("Q7", 4).file(), "has the type 'Q7'; expected one of"),
        "type without arithmetic": (lambda parts: parts.retyped("F8_E4M3", 1).file(), "has the type 'F8_E4M3'; expec"),
        "whole numbers": (lambda parts: parts.retyped("I64", 8).file(), "is int64 ({shape}); expected floating-point"),
        "bytes": (lambda parts: parts.retyped("U8", 1).file(), "is uint8 ({shape}); expected floating-point numbers"),
        "flags": (lambda parts: parts.retyped("BOOL", 1).file(), "is bool ({shape}); expected floating-point numbers"),
        "turned round": (
            lambda parts: parts.placed(shape=parts.entries[parts.matrix()]["shape"][::-1]),
            "expected floating-point numbers ({shape})",
        ),
        "missing": (_missing, "is missing; expected floating-point numbers ({shape})"),
        "no finite number": (_not_finite, "has a weight that is no finite number"),
    }
)
"""Damage of a tensor, and what the message says."""


@dataclass(frozen=True)
class Kind:
    """Kind of files of weights: folder of a sound one, name of the file, and its reader."""

    folder: Path
    file: str
    load: Callable[[Path], object]
    surplus: tuple[str, ...]


def _network() -> nn.Module:
    return nn.Sequential(nn.Linear(5, 3), nn.Linear(3, 2))


def _optimiser(network: nn.Module) -> torch.optim.Optimizer:
    return torch.optim.Adam(network.parameters())


def _restore(folder: Path) -> None:
    checkpoints.restore(folder / "best.safetensors", _network())


def _resume(folder: Path) -> None:
    network = _network()
    checkpoints.restore(folder / "last.safetensors", network, _optimiser(network))


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Kind]:
    """All kinds of models, each with a sound file."""
    folder = tmp_path_factory.mktemp("trained")
    network = _network()
    optimiser = _optimiser(network)
    network(torch.ones(1, 5)).sum().backward()
    optimiser.step()
    checkpoints.save(folder / "best.safetensors", network, {"seed": 0})
    checkpoints.save(folder / "last.safetensors", network, {"seed": 0}, optimiser)
    shipped = Path(str(files("dorothie_gym.policies").joinpath("data", "pretrained")))
    groups = ("policy/more", "policy.optimizer/0/more", "policy.optimizer/99/exp_avg", "variables/more", "more")
    return {
        "role": Kind(shipped / "co-wizard", "model.safetensors", FILES.load, ("more", "words.more")),
        "driver": Kind(shipped / "maskable-ppo", "model.safetensors", load_model, groups),
        "benchmark": Kind(folder, "best.safetensors", _restore, ("more", "model.more", "model.0.more")),
        "training": Kind(
            folder, "last.safetensors", _resume, ("more", "optimiser.0.more", "optimiser.9.step", "optimiser.more")
        ),
    }


@pytest.fixture(params=["role", "driver", "benchmark", "training"])
def kind(request: pytest.FixtureRequest, kinds: Mapping[str, Kind]) -> Kind:
    """Each kind of models."""
    return kinds[request.param]


def refusal(kind: Kind, content: bytes, folder: Path) -> str:
    """Returns the message for a file with other content; its other files are sound."""
    copy = shutil.copytree(kind.folder, folder / "copy")
    (copy / kind.file).write_bytes(content)
    with pytest.raises(DorothieGymError) as caught:
        kind.load(copy)
    message = str(caught.value)
    assert message.startswith(str(copy / kind.file)) and "\n" not in message
    return message


def test_sound_files_are_read(kind: Kind) -> None:
    kind.load(kind.folder)


@pytest.mark.parametrize("name", sorted(WRONG_FILES))
def test_damaged_file_is_one_error_that_names_it(kind: Kind, name: str, tmp_path: Path) -> None:
    damage, said = WRONG_FILES[name]
    parts = Parts.of((kind.folder / kind.file).read_bytes())
    assert said in refusal(kind, damage(parts), tmp_path)


@pytest.mark.parametrize("name", sorted(WRONG_TENSORS))
def test_damaged_tensor_is_one_error_that_names_it(kind: Kind, name: str, tmp_path: Path) -> None:
    damage, said = WRONG_TENSORS[name]
    parts = Parts.of((kind.folder / kind.file).read_bytes())
    message = refusal(kind, damage(parts), tmp_path)
    assert said.format(shape=", ".join(map(str, parts.entries[parts.matrix()]["shape"]))) in message
    assert parts.matrix() in message


def test_surplus_tensor_is_one_error_that_names_it(kind: Kind, tmp_path: Path) -> None:
    parts = Parts.of((kind.folder / kind.file).read_bytes())
    for number, name in enumerate(kind.surplus):
        message = refusal(kind, _surplus(parts, name), tmp_path / str(number))
        assert f"tensor '{name}': does not belong to the model" in message


def test_moment_of_another_shape_is_one_error_that_names_it(kinds: Mapping[str, Kind], tmp_path: Path) -> None:
    kind = kinds["training"]
    parts = Parts.of((kind.folder / kind.file).read_bytes())
    parts.entries["optimiser.0.exp_avg"]["shape"].reverse()
    message = refusal(kind, parts.file(), tmp_path)
    assert "tensor 'optimiser.0.exp_avg': is float32 (5, 3); expected floating-point numbers (3, 5)" in message


def test_weights_of_other_floating_point_types_are_read(kinds: Mapping[str, Kind], tmp_path: Path) -> None:
    network, file = _network(), tmp_path / "a.safetensors"
    for dtype in (torch.float16, torch.bfloat16, torch.float64):
        wanted = {f"model.{name}": value.to(dtype) for name, value in network.state_dict().items()}
        save_tensors(wanted, file)
        found = _network()
        checkpoints.restore(file, found)
        for name, value in found.state_dict().items():
            assert torch.equal(value, wanted[f"model.{name}"].to(torch.float32))
    save_tensors({**wanted, "model.0.bias": torch.full((3,), 1e300, dtype=torch.float64)}, file)
    with pytest.raises(DorothieGymError, match=r"model\.0\.bias': has a weight that is no finite number"):
        checkpoints.restore(file, _network())


def test_any_tensors_and_texts_are_read_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "a.safetensors"
    types = (torch.bool, torch.uint8, torch.int16, torch.int64, torch.float16, torch.bfloat16, torch.float64)
    wanted = {str(dtype): torch.arange(6).reshape(2, 3).to(dtype) for dtype in types}
    wanted |= {"empty": torch.zeros(0, 3), "one": torch.tensor(5.0)}
    save_tensors(wanted, file, {"about": '{"a": 1}', "\u00fc": "\n"})
    tensors, metadata = read_tensors(file)
    assert metadata == {"about": '{"a": 1}', "\u00fc": "\n"} and set(tensors) == set(wanted)
    for name, value in wanted.items():
        assert tensors[name].dtype == value.dtype and torch.equal(tensors[name], value)
    assert read_header(file).tensors["one"].shape == () and read_header(file).tensors["empty"].size == 0
    with pytest.raises(InputFileError, match="larger than"):
        read_tensors(file, limit=10)
