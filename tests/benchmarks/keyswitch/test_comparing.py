"""The comparison: grouped folds, the same networks, errors that do not depend on who computes them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from benchmarks.doors.keyswitch import cases
from benchmarks.keyswitch import comparing
from benchmarks.keyswitch.comparing import KIND, RECONSTRUCTION, Part, compare, folds, outcome, row_of, ways
from benchmarks.keyswitch.curves import CurveError, measured
from benchmarks.keyswitch.networks import Reconstruction, classifier
from benchmarks.keyswitch.settings import FULL, QUICK, Size
from palpate.modeling.doors.networks import ForceToPerception
from palpate.modeling.training.refusals import JobError
from palpate.modeling.training.seeding import seeded

pytestmark = pytest.mark.needs("torch")

TINY = Size(folds=2, codes=(3,), epochs=1, batch=8)


@pytest.fixture(scope="module")
def few():
    """Six switches of each kind of the shipped ones: a network's epoch takes a second."""
    curves = measured()
    rows = np.concatenate([np.flatnonzero(curves.kind == kind)[:6] for kind in range(3)])
    named = {name: tuple(getattr(curves, name)[i] for i in rows) for name in ("names", "makers", "family")}
    arrays = {name: getattr(curves, name)[rows] for name in ("kind", "travel_mm", "force_gf")}
    return replace(curves, **named, **arrays)


def test_no_family_lies_on_both_sides_and_every_switch_is_held_out_once():
    curves = measured()
    family = np.array(curves.family)
    split = folds(curves, FULL)
    assert sorted(np.concatenate([held for _, held in split])) == list(range(119))
    for train, held in split:
        assert not set(family[train]) & set(family[held])
        assert len(set(curves.kind[train])) == 3 and len(held) > 15


def test_the_networks_are_made_of_the_door_networks_blocks():
    through, forward = Reconstruction(7), ForceToPerception(3)
    assert [str(part) for part in through.encoder[0]] == [str(part) for part in forward.encoder]
    assert [str(part) for part in through.decoder[2]] == [str(part) for part in forward.decoder]
    assert str(classifier(3)) == str(forward)
    with torch.no_grad():
        given = torch.zeros(2, 621)
        assert through.encoder(given.unsqueeze(1)).shape == (2, 7) and through(given).shape == (2, 621)
        assert classifier(3)(given).shape == (2, 3)


def test_pca_with_every_component_restores_the_training_curves_and_the_mean_is_the_mean(few):
    size = replace(TINY, codes=(8,))
    train, held = folds(few, size)[0]
    mean = outcome(Part(RECONSTRUCTION, "mean curve", None, 0, size, few)).answer
    np.testing.assert_allclose(mean, np.broadcast_to(few.force_gf[train].mean(axis=0), mean.shape), rtol=1e-12)
    restored = outcome(Part(RECONSTRUCTION, "PCA", min(8, len(train)), 0, size, few)).answer
    assert np.abs(restored - few.force_gf[held]).mean() < 0.5 * np.abs(mean - few.force_gf[held]).mean()


def test_the_errors_are_those_of_the_definition(few):
    ticks = iter(range(100))

    def outcome_of(way, answers):
        parts = [Part(*way, fold, TINY, few) for fold in range(2)]
        return row_of(way, few, TINY, [replace(outcome(p, lambda: float(next(ticks))), answer=a)
                                       for p, a in zip(parts, answers, strict=True)])  # fmt: skip

    held = [rows for _, rows in folds(few, TINY)]
    off = outcome_of(
        (RECONSTRUCTION, "mean curve", None),
        [few.force_gf[rows] + np.where(rows == 0, 9.0, 1.0)[:, None] for rows in held],
    )
    assert (off.error, off.second) == pytest.approx((26 / 18, np.sqrt(98 / 18)))
    assert off.training_s == 1.0 and off.inference_s == pytest.approx(np.mean([1 / len(rows) for rows in held]))
    wrong = outcome_of(
        (KIND, "commonest kind", None), [np.where(few.kind[rows] == 2, 1, few.kind[rows]) for rows in held]
    )
    assert (wrong.error, wrong.second) == pytest.approx((100 / 3, 100 / 3))


def test_a_comparison_is_what_its_parts_give_in_any_order(few):
    size = replace(TINY, codes=(), components=5)
    lines = []
    result = compare(size, curves=few, workers=1, report=lines.append)
    assert len(lines) == 10 and "kind, network, fold 2" in lines[-1]
    parts = [Part(*way, fold, size, few) for way in ways(size) for fold in range(2)]
    again = [outcome(part) for part in reversed(parts)][::-1]
    rows = [row_of(way, few, size, again[2 * at : 2 * at + 2]) for at, way in enumerate(ways(size))]
    assert [(r.task, r.method, r.error, r.second) for r in result] == [
        (r.task, r.method, r.error, r.second) for r in rows
    ]
    assert all(0 < row.error <= 100 and row.training_s > 0 and row.inference_s > 0 for row in result)


def test_the_network_restores_what_it_was_trained_on(few):
    from benchmarks.keyswitch.reconstructing import network

    rows = few.force_gf[6:14] / 50 - 1
    size = replace(TINY, epochs=12, batch=4)
    mean = np.abs(rows - rows.mean(axis=0)).mean()
    assert np.abs(network(rows, 3, size, print)(rows) - rows).mean() < 0.8 * mean


def test_equal_curves_are_refused(few):
    flat = replace(few, force_gf=np.full_like(few.force_gf, 50.0))
    with pytest.raises(CurveError, match="all forces of the training side are 50 gf"):
        outcome(Part(KIND, "ridge on PCA", 3, 0, TINY, flat))
    with pytest.raises(JobError, match=r"job 1 \(reconstruction, mean curve, fold 1\): all forces"):
        compare(replace(TINY, codes=(), components=5), curves=flat, workers=1)


def test_the_bench_has_a_case_for_every_way_and_its_error_is_that_of_the_comparison(monkeypatch):
    bench_cases = list(cases(quick=True))
    assert len(bench_cases) == len(list(ways(QUICK))) and {case.area for case in bench_cases} == {"key switches"}
    case = next(case for case in bench_cases if case.method == "tree on the bump")
    curves = measured()
    parts = [Part(KIND, "tree on the bump", None, fold, QUICK, curves) for fold in range(QUICK.folds)]
    row = row_of((KIND, "tree on the bump", None), curves, QUICK, [comparing.outcome(part) for part in parts])
    assert case.error(case.run()) == row.error


def test_seeded_weights_do_not_depend_on_what_ran_before():
    one = seeded(lambda: Reconstruction(3), 4).encoder[2].weight
    torch.rand(3)
    assert torch.equal(one, seeded(lambda: Reconstruction(3), 4).encoder[2].weight)
