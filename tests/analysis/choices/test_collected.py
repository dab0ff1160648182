"""Choices of a study from the collected database to the answers of its plan."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from statistics import NormalDist
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from sqlalchemy import Engine

from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import Answer, QuestionResult, Selected
from palpate.analysis.plans.reading import read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.ratings.collected_choices import catch_exclusions, inattentive
from palpate.analysis.ratings.dataset import DeclarationRefused
from palpate.analysis.ratings.reading import Material, read_material
from palpate.analysis.ratings.sources import gathered
from palpate.analysis.regenerating.regeneration import run_tests
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.studies.sessions.session_files import ledgers_in
from tests.analysis.choices.collected_for_tests import QuestPlus, constant, halfway, rows, staircase, weibull_db
from tests.recorded.make_many import MANY

STUDY = "texture_similarity"
"""A recorded study: its sessions and stimuli stand for those of a study of thresholds."""


@pytest.fixture(scope="module")
def sessions() -> Iterator[Engine]:
    engine = gathered(ledgers_in(MANY, STUDY), MANY)
    yield engine
    engine.dispose()


@pytest.fixture(scope="module")
def material(sessions: Engine) -> Material:
    """The material of two tracks of each participant, with a practice trial and catch trials."""
    plain = read_material(sessions, STUDY, digest=None, include_incomplete=False, simulated=None)
    stimulus = str(plain.trials["stimulus"].iloc[0])
    own = plain.trials.drop_duplicates("session")[["participant", "session"]]
    tables = []
    for n, (who, session) in enumerate(own.itertuples(index=False, name=None)):
        rng = np.random.default_rng([5, n])
        for track, procedure in (("f40", constant), ("f250", QuestPlus())):
            levels, hits = procedure(rng, 128, weibull_db)
            table = rows(levels, hits, who, session=session, stimulus=stimulus, track=track, practice=False)
            table["procedure"] = "constant" if track == "f40" else "questplus"
            tables.append(table.assign(trial=table["trial"] + 200 * (track == "f40")))
        for trial, (right, practice, catch) in enumerate(((1, True, "none"), (1, False, "easy"), (0, False, "easy"))):
            extra = rows([0.0], [right], who, session=session, stimulus=stimulus, practice=practice, catch=catch)
            tables.append(extra.assign(trial=500 + trial, procedure="questplus"))
    whole = pd.concat(tables, ignore_index=True).drop(columns=["group"])
    whole = whole.assign(seq=range(len(whole)), attempt=1, block="main", counts=True, confidence=None, rt_s=1.0)
    repeated = whole.iloc[:3].assign(counts=False, correct=0, seq=range(9000, 9003))
    pd.concat([whole, repeated]).to_sql("choices", sessions, if_exists="replace", index=False)
    return read_material(sessions, STUDY, digest=None, include_incomplete=False, simulated=None)


def answers(material: Material, folder: Path, *tests: str) -> list[QuestionResult]:
    plan = folder / "analysis.yaml"
    plan.write_text("\n".join([f"study: {STUDY}", "tests:", *(f"  - {test}" for test in tests)]), encoding="utf-8")
    read = read_plan(plan)
    return list(run_tests(Selector(apply_exclusions(material, read.declared).material, read)))


def test_a_plan_goes_from_the_database_to_thresholds(material: Material, tmp_path: Path) -> None:
    (result,) = answers(
        material, tmp_path,
        "{name: t, test: psychometric, source: choices, function: weibull_db, lapse: [0, 0.05], draws: 99}",
    )  # fmt: skip
    assert result.answer is not None, result.refused
    found = result.answer.rows
    people = material.choices["participant"].nunique()
    assert [(row["track"], row["procedure"]) for row in found[:2]] == [("f40", "constant"), ("f250", "questplus")]
    assert len(found) == 2 * people
    assert all(row["trials"] == 128 for row in found)
    for row in found:
        assert abs(float(row["threshold"] or 0) - halfway()) < 6, row
        assert float(row["threshold_low"] or 0) < float(row["threshold"] or 0) < float(row["threshold_high"] or 0)
    assert "2 catch trial(s) left out" in str(found[1]["note"])
    assert {row["quantity"] for row in result.answer.more["summary"]} == {"threshold", "jnd"}
    assert result.answer.headline.startswith("Mean track f40: threshold")


def test_practice_and_catch_trials_have_lines_and_repeated_answers_do_not_count(material: Material) -> None:
    whats = [line.what for line in material.exclusions]
    assert whats.count("practice") == whats.count("catch") == material.choices["session"].nunique()
    assert not material.choices.duplicated(["session", "trial"]).any()
    assert set(material.choices["group"]) == {""}


def test_the_catch_rule_of_the_study_leaves_people_out_with_a_line(material: Material) -> None:
    """One of two catch trials is wrong: more than 0.3, not more than 0.5."""
    lines = inattentive(material.choices, 0.3)
    assert len(lines) == material.choices["participant"].nunique()
    assert lines[0].why == "1 of 2 catch trials answered wrongly, above the study's 0.3"
    assert lines[0].rows == 258
    assert inattentive(material.choices, 0.5) == []
    study: Any = SimpleNamespace(intervals=SimpleNamespace(catch=SimpleNamespace(exclude_above=0.3)))
    assert catch_exclusions(study, material.choices) == lines
    assert catch_exclusions(material.study, material.choices) == []  # type: ignore[arg-type]


def test_sensitivity_of_a_plan(material: Material, tmp_path: Path) -> None:
    (result,) = answers(material, tmp_path, "{name: d, test: dprime, where: {track: f40}}")
    assert result.answer is not None, result.refused
    row = result.answer.rows[0]
    assert (row["design"], row["model"], row["trials"]) == ("forced_choice", "two_intervals", 128)
    assert 0.5 < float(row["dprime"] or 0) < 2.5
    assert row["dprime_low"] is not None
    assert result.answer.more["summary"][0]["n"] == len(result.answer.rows)


def test_tracks_of_several_procedures_are_refused_and_what_the_design_decides_is_noted(
    material: Material, tmp_path: Path
) -> None:
    where = "interval: none, where: {track: f40, participant: P001}"
    one, own, several = answers(
        material, tmp_path,
        f"{{name: a, test: psychometric, source: choices, {where}, task: symmetric, correct: hit, falling: true}}",
        f"{{name: b, test: psychometric, source: choices, {where}}}",
        "{name: c, test: psychometric, source: choices, interval: none, by: [participant]}",
    )  # fmt: skip
    assert one.answer is not None and own.answer is not None and one.answer.rows == own.answer.rows
    design = "has no effect with `source: choices`, whose design decides it."
    assert [f"The plan's `{name}` {design}" in one.answer.notes for name in ("task", "correct", "falling")] == [
        True
    ] * 3
    assert "several values of procedure" in several.refused


def answer(test: str, table: pd.DataFrame, **settings: Any) -> Answer:
    kind = kinds.TESTS[test]
    own = {"source": "choices"} if test == "psychometric" else {}
    given = Selected(table, pd.DataFrame(), (), {}, seed=3, draws=99)
    return kind.answer(given, kind.settings.model_validate({"name": "x", "test": test, **own, **settings}))


def test_a_guess_rate_that_the_design_decides_is_refused() -> None:
    levels, hits = constant(np.random.default_rng(1), 128, weibull_db)
    with pytest.raises(DeclarationRefused, match="the design of these choices decides `guess`"):
        answer("psychometric", rows(levels, hits), guess=0.3)


def test_a_track_of_50_questplus_trials_is_no_step(full_run: bool) -> None:
    """Each gets a posterior with its interval; the bounded slope is said."""
    for seed in range(60 if full_run else 6):
        levels, hits = QuestPlus()(np.random.default_rng([9, seed]), 50, weibull_db)
        table = rows(levels, hits, procedure="questplus")
        (row,) = answer("psychometric", table, function="weibull", level_unit="db", lapse=(0, 0.04)).rows
        assert row["threshold"] is not None, row["note"]
        assert "the posterior's prior bounds it" in str(row["note"])


def test_constant_levels_that_step_get_the_posterior_and_a_note() -> None:
    levels = np.repeat([1.0, 2, 3, 4], 40)
    (row,) = answer("psychometric", rows(levels, np.concatenate([[0, 1] * 40, np.ones(80)]))).rows
    assert 1 < float(row["threshold"] or 0) < 3.5
    assert "estimates are from the posterior, whose prior bounds the slope" in str(row["note"])


def test_a_comparison_around_a_standard_is_symmetric_and_has_a_weber_fraction() -> None:
    """The PSE is 102, the SD 8: JND .6745 x 8 = 5.4, Weber fraction .054 of the standard 100."""
    rng = np.random.default_rng(6)
    levels = np.repeat(np.arange(80.0, 121, 5), 60)
    from scipy.special import ndtr

    hit = (rng.random(len(levels)) < ndtr((levels - 102) / 8)).astype(float)
    table = rows(levels, hit, standard=100.0, hit=hit)
    (row,) = answer("psychometric", table, function="gaussian", interval="profile").rows
    assert float(row["threshold"] or 0) == pytest.approx(102, abs=1.5)
    assert float(row["weber"] or 0) == pytest.approx(float(row["jnd"] or 0) / 100)
    assert float(row["jnd"] or 0) == pytest.approx(5.4, abs=0.8)


def test_a_forced_choice_above_a_standard_has_the_distance_as_jnd_and_a_ratio_in_db() -> None:
    """A JND of 1.5 dB is a Weber fraction of 10^(1.5 / 20) - 1 = .189."""
    rng = np.random.default_rng(8)
    levels = np.repeat(np.array([-19.5, -19, -18.5, -18, -17]), 120)
    hits = (rng.random(len(levels)) < weibull_db(levels, threshold=-18.2, slope=30.0)).astype(float)
    table = rows(levels, hits, standard=-20.0)
    (row,) = answer("psychometric", table, function="weibull", level_unit="db", interval="profile").rows
    jnd = float(row["jnd"] or 0)
    assert jnd == pytest.approx(float(row["threshold"] or 0) + 20)
    assert float(row["weber"] or 0) == pytest.approx(10 ** (jnd / 20) - 1)
    assert jnd == pytest.approx(halfway(-18.2, 30.0) + 20, abs=0.3)


def test_yes_no_takes_its_guess_rate_from_the_trials_without_a_signal() -> None:
    rng = np.random.default_rng(3)
    levels, hits = constant(rng, 160, lambda x: weibull_db(x, guess=0.1))
    signal = rows(levels, hits, design="yes_no", target="signal", chosen="yes")
    false = (rng.random(60) < 0.1).astype(float)
    noise = rows(
        np.full(60, np.nan), 1 - false, design="yes_no", target="noise", catch="absent", hit=false, chosen="no"
    )
    table = pd.concat([signal, noise.assign(trial=noise["trial"] + 500)], ignore_index=True)
    (row,) = answer("psychometric", table, function="weibull_db", interval="profile").rows
    assert row["trials"] == 160
    assert 0.02 < float(row["guess"] or 0) < 0.25
    assert float(row["threshold"] or 0) == pytest.approx(halfway(), abs=4)
    (own,) = answer("dprime", table).rows
    assert (own["model"], own["trials"]) == ("yes_no", 220)


@pytest.mark.parametrize(("truth", "side"), [(1.0, "below"), (0.5, "above")])
def test_no_bare_number_for_an_extreme_observer(truth: float, side: str) -> None:
    levels, hits = staircase(np.random.default_rng(2), 96, lambda x: truth + 0 * x)
    (row,) = answer("psychometric", rows(levels, hits, procedure="staircase")).rows
    assert (row["threshold"], row["outside"], row["sure"]) == (None, side, 0.95)
    assert f"the threshold is {side}" in str(row["note"])


def test_differences_from_a_standard_above_fall_with_the_level_and_on_both_sides_have_no_function() -> None:
    """Same/different, standard 10: the further below, the more often different."""
    levels = np.repeat(np.arange(1.0, 10.0), 12)
    hits = (np.random.default_rng(3).random(len(levels)) < 0.05 + 0.93 / (1 + np.exp(1.5 * (levels - 5)))).astype(float)
    own = {"design": "same_different", "standard": 10.0, "target": "different"}
    table = rows(levels, hits, **own, chosen="x")
    (row,) = answer("psychometric", table).rows
    assert row["outside"] is None and row["threshold"] == pytest.approx(5, abs=0.6)
    assert float(row["likelihood_ratio"] or 0) > 1e6
    with pytest.raises(StatisticsError, match="on both sides of a standard"):
        answer("psychometric", rows(levels + 5, hits, **own, chosen="x"))


@pytest.mark.parametrize("below", [1.0, 0.5])
def test_d_prime_around_a_standard_is_of_right_answers_whichever_interval_has_them(below: float) -> None:
    """Of a comparison below its standard the standard is the right choice; 85 % are right on both sides."""
    count = 400
    chance = np.random.default_rng(8)
    level = np.where(chance.random(count) < below, 60.0, 140.0)
    correct = chance.random(count) < 0.85
    target = np.where(chance.random(count) < 0.5, "1", "2")
    hit = correct == (level > 100)
    chosen = np.where(hit, target, np.where(target == "1", "2", "1"))
    table = rows(level, correct.astype(float), standard=100.0, target=target, chosen=chosen, hit=hit.astype(float))
    (row,) = answer("dprime", table, by=("participant",)).rows
    share = correct.mean()
    assert row["dprime"] == pytest.approx(math.sqrt(2) * NormalDist().inv_cdf(share), abs=0.1) and row["note"] == ""
