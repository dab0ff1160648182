"""What a training leaves behind: history, learning curve, run card, words about time."""

import json
from dataclasses import astuple

import pytest

from palpate.modeling.training.history import Epoch, remove_history, write_history
from palpate.modeling.training.run_card import BESIDE, run_card
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.trained_files import learning_curve, save_learning_curve
from palpate.protocols.canonical import NotCanonical, digest
from palpate.protocols.progress import Pace, lasting

pytestmark = pytest.mark.needs("torch")

HISTORY = (Epoch(1, 0.5, 1e-3, 2.25, 2.5), Epoch(2, 1.1, 1e-3, 1 / 3, None), Epoch(3, 1.6, 5e-4, 0.2, 0.4))


def test_a_history_reads_back_to_the_bit(tmp_path):
    path = write_history(HISTORY, tmp_path / "door.history.csv")
    header, *lines = path.read_text().splitlines()
    assert header == "epoch,seconds,learning_rate,train_loss,held_loss"
    cells = [[float(cell) if cell else None for cell in line.split(",")] for line in lines]
    assert cells == [list(astuple(epoch)) for epoch in HISTORY]
    assert [item.name for item in tmp_path.iterdir()] == ["door.history.csv"]


def test_an_older_models_history_is_removed_and_somebodys_own_table_is_not(tmp_path):
    own = [tmp_path / f"mine.history.{kind}" for kind in ("csv", "svg")]
    for path in own:
        path.write_text("epoch,pleasure\n")
    write_history(HISTORY, tmp_path / "door.history.csv")
    save_learning_curve({"": HISTORY}, tmp_path, "door.history")
    for name in ("door", "mine", "absent"):
        remove_history(tmp_path, name)
    assert sorted(tmp_path.iterdir()) == own


def test_the_learning_curve_is_the_same_file_for_the_same_numbers(tmp_path):
    one, other = (save_learning_curve({"network": HISTORY[:1] + HISTORY[2:]}, tmp_path / f, "curve") for f in "ab")
    assert [path.name for path in one] == ["curve.svg", "curve.png"]
    assert one[0].read_bytes() == other[0].read_bytes()
    named, alone = (learning_curve({name: HISTORY[:1]}).axes[0].get_legend_handles_labels()[1] for name in ("one", ""))
    (last,) = learning_curve({"": HISTORY[2:] + HISTORY[:1]}, last=True).axes[0].get_legend_handles_labels()[1]
    assert last == "last 2.5 after 0.5 s (epoch 1 of 1)"
    assert alone[0].startswith("best 2.5 after 0.5 s") and named == [alone[0].replace("best", "one:")]


def test_a_run_card_holds_what_a_run_was_made_from_and_no_nan(tmp_path):
    card = run_card({"train": "ab" * 32}, Settings(checkpoint=tmp_path, epochs=7), {"MAE": 2.5}, 12.25)
    assert json.loads(json.dumps(card)) == card
    assert set(card["versions"]) - set(BESIDE) == {"python", "palpate", "numpy", "scipy", "torch", "scikit-learn"}
    assert card["configuration"]["epochs"] == 7 and card["data"] == {"train": "ab" * 32} and card["seconds"] == 12.25
    assert card["digest"] == digest({name: value for name, value in card.items() if name != "digest"})
    with pytest.raises(NotCanonical):
        run_card({}, {}, {"MAE": float("nan")}, 1.0)


def test_the_time_left_goes_by_the_last_steps():
    times = iter([0.0, 100.0, 101.0, 102.0, 103.0, 104.0, 105.0, 106.0])
    pace = Pace(10, lambda: next(times))
    assert pace.left_s == 0.0
    for _ in range(7):
        pace.step()
    assert (pace.done, pace.left_s) == (7, 3.0)  # the first step's 100 s are forgotten
    assert [lasting(s) for s in (0.2, 8.4, 150, 7500)] == ["less than 1 s", "8 s", "2 min", "2 h 05 min"]
