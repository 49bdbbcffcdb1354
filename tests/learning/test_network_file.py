from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from wristctl.errors import UserError
from wristctl.learning.domain import Domain
from wristctl.learning.network import Network, Scaler
from wristctl.learning.network_file import load_network, save_network, training_record
from wristctl.learning.training_result import TrainingResult

RECORD: dict[str, object] = {"seed": 3, "settings": {"epochs": 5, "hidden": [24, 16]}, "data_sha256": "ab12"}


@pytest.fixture
def network(trained: TrainingResult) -> Network:
    return trained.network


@pytest.fixture
def file(network: Network, tmp_path: Path) -> Path:
    path = tmp_path / "network.safetensors"
    save_network(network, path, RECORD)
    return path


def header(path: Path) -> dict[str, object]:
    from safetensors import safe_open

    with safe_open(path, "numpy") as opened:
        return dict(json.loads(opened.metadata()["wristctl"]))


def rejected(path: Path, message: str) -> None:
    with pytest.raises(UserError, match=message) as caught:
        load_network(path)
    assert caught.value.exit_code == 2 and caught.value.where == str(path) and caught.value.fix


def test_a_network_read_back_is_the_same_to_the_bit(network: Network, file: Path) -> None:
    back = load_network(file)
    tip = np.random.default_rng(0).uniform((0.06, -0.04), (0.08, 0.04), (50, 2))
    assert back.angle(tip).tobytes() == network.angle(tip).tobytes()
    assert back.domain == network.domain and back.sizes == (2, 24, 16, 1)
    assert training_record(file) == RECORD


def test_the_header_tells_units_scalers_and_domain(network: Network, file: Path) -> None:
    told: dict[str, Any] = header(file)
    assert told["input"]["unit"] == "m" and told["output"]["unit"] == "rad"
    assert told["input"]["mean"] == network.input_scaler.mean.tolist()
    assert tuple(told["domain"]["theta"]) == network.domain.theta


def test_the_same_network_gives_the_same_bytes(network: Network, file: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.safetensors"
    save_network(network, again, RECORD)
    assert again.read_bytes() == file.read_bytes()
    assert len(_metadata(file)) == 1, "safetensors writes several entries in random order"


def _metadata(path: Path) -> dict[str, str]:
    from safetensors import safe_open

    with safe_open(path, "numpy") as opened:
        return dict(opened.metadata())


def test_missing_file_is_the_users_error(tmp_path: Path) -> None:
    rejected(tmp_path / "none.safetensors", "no such network file")


@pytest.mark.parametrize("keep", [0, 7, 100, -8])
def test_truncated_file_is_the_users_error(file: Path, keep: int) -> None:
    file.write_bytes(file.read_bytes()[:keep])
    rejected(file, "not a readable safetensors file")


def test_other_peoples_safetensors_are_the_users_error(file: Path) -> None:
    save_file({"a": np.zeros(3)}, file)
    rejected(file, "not one of wristctl's networks")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "wristctl.network/9"}, "format"),
        ({"activation": "gelu"}, "activation"),
        ({"hidden": [24, 17]}, r"1.weight is \(16, 24\).*header says \(17, 24\)"),
        ({"hidden": [24, 16, 4]}, "2.weight is"),
        ({"input": {"mean": [0, 0], "deviation": [0, 1]}}, "deviation"),
        (
            {"input": {"mean": [0, 0, 0], "deviation": [1, 1, 1]}},
            "input is wrong: .*mean and deviation need 2 values each",
        ),
        ({"input": {"unit": "mm", "mean": [0, 0], "deviation": [1, 1]}}, "input.unit"),
        ({"domain": {"theta": [-1.0, 1.0]}}, "domain.arc_length"),
        (
            {"others": [{"name": "pose", "unit": "rad", "mean": 0, "deviation": 1, "range": [0, 1]}]},
            r"0.weight is \(24, 2\).*header says \(24, 3\)",
        ),
    ],
)
def test_header_that_does_not_fit_is_the_users_error(file: Path, change: dict[str, object], message: str) -> None:
    tensors = load_file(file)
    save_file(tensors, file, {"wristctl": json.dumps({**header(file), **change})})
    rejected(file, message)


def test_a_network_of_pose_and_mass_reads_back_with_its_segments(network: Network, tmp_path: Path) -> None:
    first = np.hstack([network.weights[0], np.full((24, 2), 0.3)])
    more = replace(
        network,
        weights=(first, *network.weights[1:]),
        input_scaler=Scaler(np.array([0.07, 0.0, 1.5, 0.4]), np.array([0.01, 0.02, 1.2, 0.1])),
        domain=Domain(network.domain.theta, network.domain.arc_length, ((0.0, 3.0), (0.3, 0.5))),
        others=("pose", "hand_mass"),
        segments=4,
    )
    path = tmp_path / "more.safetensors"
    save_network(more, path, RECORD)
    back = load_network(path)
    inputs = np.array([[0.07, 0.02, 1.0, 0.35]])
    assert back.angle(inputs).tobytes() == more.angle(inputs).tobytes()
    assert (back.domain, back.others, back.segments) == (more.domain, more.others, 4)


def test_header_that_is_no_json_is_the_users_error(file: Path) -> None:
    save_file(load_file(file), file, {"wristctl": "{oops"})
    rejected(file, "header's text is wrong")


def test_weights_that_are_not_finite_are_the_users_error(network: Network, tmp_path: Path) -> None:
    weight = network.weights[1].copy()
    weight[3, 2] = np.nan
    path = tmp_path / "nan.safetensors"
    save_network(replace(network, weights=(network.weights[0], weight, network.weights[2])), path, RECORD)
    rejected(path, "1.weight holds numbers that are not finite")


@pytest.mark.parametrize(("name", "size"), [("BF16", 2), ("F8_E4M3", 1), ("Q99", 8)])
def test_an_array_of_a_type_that_numpy_has_not_is_the_users_error(tmp_path: Path, name: str, size: int) -> None:
    header = json.dumps({"0.weight": {"dtype": name, "shape": [1], "data_offsets": [0, size]}}).encode()
    file = tmp_path / "network.safetensors"
    file.write_bytes(len(header).to_bytes(8, "little") + header + bytes(size))
    rejected(file, "not a readable safetensors file")


@pytest.mark.parametrize("change", ["missing", "single"])
def test_missing_or_single_precision_array_is_the_users_error(file: Path, change: str) -> None:
    tensors, told = load_file(file), header(file)
    if change == "missing":
        del tensors["2.bias"]
    else:
        tensors["2.bias"] = tensors["2.bias"].astype(np.float32)
    save_file(tensors, file, {"wristctl": json.dumps(told)})
    rejected(file, "2.bias")
