"""Weights in files: both formats give the same state; what is not whole, not ours or would run is refused."""

import hashlib
import pickle
import shutil

import pytest
import torch
from safetensors.torch import save_file

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.resnet_weights import COUNTED, Weights, read_weights, weights_from
from tests.modeling.attributes.weights_for_tests import drawn_state

pytestmark = pytest.mark.needs("torch")


@pytest.fixture
def tmp_path(tmp_path):
    """Emptied afterwards: each of these files has 100 MB."""
    yield tmp_path
    shutil.rmtree(tmp_path)


@pytest.fixture(scope="module")
def state():
    return drawn_state()


def written(path, state):
    if path.suffix == ".safetensors":
        save_file({name: tensor.contiguous() for name, tensor in state.items()}, path)
    else:
        torch.save(state, path)
    return path


def read(path):
    return weights_from(path).state()


@pytest.mark.parametrize("name", ["own.pth", "own.pt", "resnet50-0676ba61.safetensors"])
def test_both_formats_give_the_state_and_are_described_by_their_sha256(tmp_path, state, name):
    path = written(tmp_path / name, state)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    weights = weights_from(path, digest)
    assert weights.description == f"{name}, SHA-256 {digest}" and weights.key == digest
    for key, tensor in weights.state().items():
        assert tensor.dtype == (torch.int64 if key.endswith(COUNTED) else torch.float32)
        assert key.endswith(COUNTED) or torch.equal(tensor, state[key]), key
    assert list(weights.state()) == list(state)


def test_the_old_format_of_pth_half_floats_and_no_counts_do_as_well(tmp_path, state):
    torch.save({k: v for k, v in state.items() if not k.endswith(COUNTED)}, tmp_path / "old.pth",
               _use_new_zipfile_serialization=False)  # fmt: skip
    assert len(read(tmp_path / "old.pth")) == 320
    halves = {name: tensor.half() if tensor.is_floating_point() else tensor for name, tensor in state.items()}
    tensors = read(written(tmp_path / "half.safetensors", halves))
    assert tensors["fc.bias"].dtype == torch.float32
    torch.testing.assert_close(tensors["fc.bias"], state["fc.bias"], atol=1e-3, rtol=1e-3)


def test_without_a_file_they_are_random_and_say_so():
    assert weights_from(None).description == "random (He normal, seed 0): no file of pretrained weights was given"
    assert Weights(seed=3).key == "random 3"
    assert len(Weights(seed=3).state()) == 320


def test_a_digest_that_is_demanded_or_named_must_be_the_file_s(tmp_path, state):
    path = written(tmp_path / "own.pth", state)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    named = path.rename(tmp_path / f"resnet50-{digest[:8]}.pth")
    assert weights_from(named).sha256 == digest
    with pytest.raises(MaterialError, match="deadbeef is demanded"):
        weights_from(named, "deadbeef")
    published = named.rename(tmp_path / "resnet50-0676ba61.pth")
    with pytest.raises(MaterialError, match=r"begins with [0-9a-f]{16}, and 0676ba61 is in its name"):
        weights_from(published)


def test_a_file_that_changes_after_it_was_chosen_is_refused(tmp_path, state):
    path = written(tmp_path / "own.pth", state)
    chosen = weights_from(path)
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(MaterialError, match="has changed since"):
        chosen.state()


def changed(state, **changes):
    new_state = {**state, **{name.replace("__", "."): value for name, value in changes.items()}}
    return {name: value for name, value in new_state.items() if value is not None}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"layer1__0__conv1__weight": None}, r"1 of 267 tensors lack \(layer1.0.conv1.weight first\)"),
        ({"layer9__weight": torch.zeros(1)}, r"1 are no part of it \(layer9.weight first\)"),
        ({"conv1__weight": torch.zeros(64, 1, 7, 7)}, r"conv1.weight is torch.float32 of \(64, 1, 7, 7\)"),
        ({"fc__bias": torch.zeros(1000, dtype=torch.int64)}, r"fc.bias is torch.int64 of \(1000,\), floats of"),
        ({"bn1__weight": torch.full((64,), float("nan"))}, "bn1.weight holds a number that is not finite"),
        ({"bn1__bias": torch.full((64,), 1e300, dtype=torch.float64)}, "bn1.bias holds a number that is not finite"),
        ({"bn1__running_var": torch.full((64,), -1.0)}, "bn1.running_var holds a variance below 0"),
    ],
)
def test_states_that_are_not_the_network_s_are_refused(tmp_path, state, change, message):
    path = written(tmp_path / "own.safetensors", changed(state, **change))
    with pytest.raises(MaterialError, match=rf"own.safetensors: {message}.*torchvision's ResNet-50 is expected"):
        read(path)


def test_whole_networks_lists_and_other_names_are_refused(tmp_path, state):
    for what, message in (([1, 2], "a list is found"), ({"state_dict": state}, "267 of 267 tensors lack")):
        torch.save(what, tmp_path / "other.pth")
        with pytest.raises(MaterialError, match=message):
            read(tmp_path / "other.pth")
    torch.save(torch.nn.Linear(2, 2), tmp_path / "whole.pth")
    with pytest.raises(MaterialError, match="no plain weights can be read"):
        read(tmp_path / "whole.pth")


@pytest.mark.parametrize("name", ["own.pth", "own.safetensors"])
@pytest.mark.parametrize("damage", [lambda data: data[: len(data) // 2], lambda data: b"", lambda data: b"\0" * 4096])
def test_damaged_files_are_refused(tmp_path, state, name, damage):
    path = written(tmp_path / name, state)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(MaterialError, match=rf"{name}: no .* read|{name}: no safetensors file, or damaged"):
        read(path)


class Runs:
    """What a pickle may carry: a call that is made when it is read."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return eval, (f"open({str(self.place)!r}, 'w').close()",)


@pytest.mark.parametrize("zipped", [True, False])
def test_a_file_that_would_run_something_is_refused_and_does_not(tmp_path, state, zipped):
    proof = tmp_path / "it_ran"
    path = tmp_path / "evil.pth"
    torch.save({**state, "more": Runs(proof)}, path, _use_new_zipfile_serialization=zipped)
    with pytest.raises(MaterialError, match="no plain weights can be read"):
        read(path)
    path.write_bytes(pickle.dumps(Runs(proof)))
    with pytest.raises(MaterialError, match="no plain weights can be read"):
        read(path)
    assert not proof.exists()
    pickle.loads(path.read_bytes())
    assert proof.exists(), "the file would have run"


def test_other_kinds_of_files_and_none_at_all_are_refused(tmp_path):
    with pytest.raises(MaterialError, match=r"files named .pth, .pt or .safetensors"):
        weights_from(tmp_path / "weights.h5")
    with pytest.raises(MaterialError, match="cannot be read"):
        weights_from(tmp_path / "none.pth")
    with pytest.raises(MaterialError, match="cannot be read"):
        read_weights(tmp_path / "none.pth", "")
