"""A training that is killed and continued gives what one that was not gives: the same bits."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from torch import nn

from palpate.modeling.training.checkpoints import read_checkpoint, read_latest
from palpate.modeling.training.loop import train
from palpate.modeling.training.refusals import CheckpointError
from palpate.modeling.training.sources import GeneratedRows
from tests.modeling.training.small import network, rows, settings, the_same, trained

pytestmark = pytest.mark.needs("torch")

ROOT = Path(__file__).parents[3]
PLACES = {
    "told": random.Random(6).randint(2, 11),
    "mid-write": 2 * random.Random(7).randint(2, 11) - 1,  # the tensors of an epoch are half there
    "before the name": 2 * random.Random(8).randint(2, 11),  # the JSON file: its tensors are there already
}
"""Where the training is killed, and at which time it comes there."""

CHILD = """
import os, signal, stat, sys
from pathlib import Path
from tests.modeling.training.small import trained

def train_until(folder, where, count, told):
    seen = 0
    def at(here, file=None):
        nonlocal seen
        seen += here == where
        if here == where and seen == count:
            if where == "told":
                os.write(told, b".")
                signal.pause()
            if file is not None:
                os.ftruncate(file, 200)
            os.kill(os.getpid(), signal.SIGKILL)
    replace, fsync = os.replace, os.fsync
    os.replace = lambda source, target: (at("before the name"), replace(source, target))
    is_file = lambda file: stat.S_ISREG(os.fstat(file).st_mode)  # not the folder, which is synced as well
    os.fsync = lambda file: (is_file(file) and at("mid-write", file), fsync(file))
    trained(checkpoint=Path(folder), report=lambda line: at("told"))
    os._exit(0)

trained(epochs=1)  # what a first training imports, once for all of them
for folder, where, count in zip(*[iter(sys.argv[1:])] * 3):
    ready, told = os.pipe()
    child = os.fork()
    if not child:
        train_until(folder, where, int(count), told)
    if where == "told":
        os.read(ready, 1)
        os.kill(child, signal.SIGKILL)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """The folders of trainings that were killed, each in a process of its own (one import of torch for all)."""
    folders = {where: tmp_path_factory.mktemp("killed") for where in PLACES}
    arguments = [str(word) for where, count in PLACES.items() for word in (folders[where], where, count)]
    child = subprocess.run(
        [sys.executable, "-c", CHILD, *arguments],
        cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, timeout=100, check=False,
    )  # fmt: skip
    assert child.stdout.split() == [str(-signal.SIGKILL)] * len(PLACES), child.stderr
    return folders


@pytest.mark.parametrize("where", PLACES)
def test_killed_and_continued_is_the_same_to_the_bit(where, killed):
    folder, count = killed[where], PLACES[where]
    lines = []
    continued = trained(checkpoint=folder, report=lines.append)
    assert the_same(continued, trained())
    epochs = (count - 1) if where == "told" else (count - 1) // 2
    assert continued[1].continued_from == epochs
    assert lines[0] == f"continuing after epoch {epochs}, from {folder}"
    assert len(list(folder.iterdir())) == 4  # two checkpoints, nothing unfinished


def test_a_finished_training_continued_for_more_epochs_equals_one_that_ran_them_at_once(tmp_path):
    trained(checkpoint=tmp_path, epochs=5, every_epochs=4)
    assert sorted(path.stem for path in tmp_path.glob("*.json")) == ["epoch-000004", "epoch-000005"]
    assert the_same(trained(checkpoint=tmp_path, epochs=12), trained())


def test_a_finished_training_is_only_read(tmp_path):
    whole = trained(checkpoint=tmp_path)
    assert the_same(trained(checkpoint=tmp_path), whole)


def flipped(path, where):
    data = bytearray(path.read_bytes())
    data[where] ^= 1
    path.write_bytes(bytes(data))


DAMAGE = {
    "a flipped bit of a weight": lambda folder: flipped(folder / "epoch-000012.safetensors", -3),
    "a flipped bit of the text": lambda folder: flipped(folder / "epoch-000012.json", 90),
    "a text cut short": lambda folder: (folder / "epoch-000012.json").write_bytes(b'{"format":'),
    "tensors cut short": lambda folder: os.truncate(folder / "epoch-000012.safetensors", 100),
    "tensors gone": lambda folder: (folder / "epoch-000012.safetensors").unlink(),
    "a foreign file": lambda folder: (folder / "epoch-000012.json").write_text("[1, 2]"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_checkpoint_is_reported_and_the_one_before_it_is_used(damage, tmp_path):
    trained(checkpoint=tmp_path)
    DAMAGE[damage](tmp_path)
    with pytest.raises(CheckpointError, match="is damaged"):
        read_checkpoint(tmp_path / "epoch-000012.json")
    lines = []
    again = trained(checkpoint=tmp_path, report=lines.append)
    assert "epoch-000012.json is damaged" in lines[0] and "The one before it is used" in lines[0]
    assert again[1].continued_from == 11
    assert the_same(again, trained())


def test_where_all_are_damaged_the_training_begins_anew_and_says_so_and_is_kept_again(tmp_path):
    trained(checkpoint=tmp_path)
    for path in tmp_path.glob("*.json"):
        path.write_text("{}")
    lines = []
    assert read_latest(tmp_path, lines.append) is None
    assert len(lines) == 2
    trained(checkpoint=tmp_path, epochs=3)
    assert sorted(path.stem for path in tmp_path.glob("*.json")) == ["epoch-000002", "epoch-000003"]
    again = trained(checkpoint=tmp_path)
    assert again[1].continued_from == 3 and the_same(again, trained())


@pytest.mark.parametrize("ends", [{"epochs": 5}, {"stop_patience": 2}])
def test_a_checkpoint_beyond_the_requested_epochs_is_refused(ends, tmp_path):
    given = {"plateau_patience": None, "learning_rate": 0.05}
    trained(checkpoint=tmp_path, **given)
    after = len(trained(**given, **ends)[1].history)
    with pytest.raises(CheckpointError, match=f"holds 12 epochs, and this training ends after {after}"):
        trained(checkpoint=tmp_path, **given, **ends)


class Noisy(nn.Module):
    """It draws in evaluation mode too."""

    def __init__(self):
        super().__init__()
        self.inner = network()

    def forward(self, x):
        return self.inner(nn.functional.dropout(x, 0.3, training=True))


def test_that_it_is_kept_changes_no_bit_of_a_training_that_draws_always(tmp_path):
    assert the_same(trained(Noisy(), checkpoint=tmp_path, epochs=3), trained(Noisy(), epochs=3))


def test_other_rows_made_from_the_same_are_another_training(tmp_path):
    inputs, targets = (torch.from_numpy(array).float() for array in rows())

    def network_of(count):
        source = GeneratedRows(count, lambda which, _chance: (inputs[which], targets[which]), "a digest")
        train(network(), source, None, nn.functional.mse_loss, settings(checkpoint=tmp_path, epochs=2))

    network_of(40)
    with pytest.raises(CheckpointError, match="rows: recorded 40, now 8"):
        network_of(8)


OTHER = {
    "data": {"data": rows(seed=6)},
    "starting weights": {"model": network(seed=4)},
    "settings.batch: recorded 8, now 4": {"batch": 4},
    "loss of the first rows": {"loss": lambda answer, target: (answer - target).abs().mean()},
}


@pytest.mark.parametrize("what", OTHER)
def test_a_checkpoint_of_another_training_is_refused_by_name(what, tmp_path):
    trained(checkpoint=tmp_path, epochs=2)
    with pytest.raises(CheckpointError, match=f"holds another training.*{what}"):
        trained(checkpoint=tmp_path, **OTHER[what])
