"""Power by simulation: the same people as a simulated lab's, the plan's own test, and what chance alone finds."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from palpate.analysis.plans.answers import Answer
from palpate.analysis.power.commands import Numbers, planned_verdict, power
from palpate.analysis.power.curve import (
    Point,
    check_power,
    estimate_s,
    needed,
    one_run,
    power_curve,
    results_of,
    suffices,
    wilson,
)
from palpate.analysis.power.p_values import p_of
from palpate.analysis.power.request import PowerError, PowerRequest, check_request
from palpate.analysis.power.simulated_studies import people, simulated_material, with_effect
from palpate.analysis.ratings.reading import read_material
from palpate.analysis.ratings.sources import gathered
from palpate.protocols.plan import compile_plan
from palpate.studies.catalogue import SHIPPED, find, read_study
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated

STUDY = """
study: pairs
task: slider_rating
stimuli: stimuli.csv
attributes: [[Rough, Smooth]]
scale: {from: 0, to: 100}
order: {design: random}
needs: [samples, window]
simulation: {latents: {Rough: {height: 8}}, noise_sd: 10, bias_sd: 5, gain_sd: 0}
"""
PLAN = """
study: pairs
tests:
  - {name: textures, test: anova, within: [stimulus]}
  - {name: pairs, test: pairs, factor: stimulus, correction: holm}
"""


@pytest.fixture
def lab(tmp_path):
    folder = tmp_path / "studies" / "pairs"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(STUDY)
    (folder / "stimuli.csv").write_text("id,height\na,0\nb,1\nc,2\n")
    (folder / "analysis.yaml").write_text(PLAN)
    return tmp_path


def asking(lab, **changes):
    folder = lab / "studies" / "pairs"
    return PowerRequest(folder / "study.yaml", folder / "analysis.yaml", lab, "textures", **changes)


@pytest.mark.parametrize(
    ("name", "count"),
    [("texture_similarity", 3), ("door_lexicon", 2), ("door_authoring", 2), ("roughness_discrimination", 2)],
)
def test_a_session_in_memory_answers_as_one_on_disk_does(tmp_path, name, count):
    study = read_study(SHIPPED / name / "study.yaml").study
    forms = lab_forms(study, tmp_path, live=False)
    for who in people(count):
        start(tmp_path, compile_plan(study, allocate(study, who), 5, forms), simulated(study, SHIPPED / name))
    engine = gathered(sorted((tmp_path / "sessions").glob("*.sqlite")), tmp_path)
    stored = read_material(engine, name, digest=None, include_incomplete=False, simulated=None)
    engine.dispose()
    in_memory = simulated_material(study, tmp_path, people(count), 5)
    for table in ("trials", "words", "forms"):
        one, other = getattr(in_memory, table), getattr(stored, table)
        assert one[list(other.columns)].equals(other), table
    choices = in_memory.choices
    assert len(choices) == len(stored.choices)
    assert not len(choices) or choices[list(stored.choices.columns)].equals(stored.choices)
    if stored.ratings is not None:
        columns = [name for name in stored.ratings.table.columns if name != "response_time_s"]
        assert in_memory.ratings.table[columns].equals(stored.ratings.table[columns])


def test_without_an_effect_people_feel_no_difference_but_keep_their_noise():
    study = read_study(SHIPPED / "door_ratings" / "study.yaml").study
    none = with_effect(study, 0.0).simulation
    assert none.latents["Easy-to-pull"] == {"mean_force_N": 0.0, "first_peak_N": 0.0, "intercept": 0.5}
    assert none.noise_sd == study.simulation.noise_sd
    assert with_effect(study, 1.0).simulation.latents == study.simulation.latents


@pytest.mark.long
def test_more_people_and_larger_effects_find_more(lab):
    weak, strong = (power_curve(asking(lab, effect=effect), [3, 12], 20) for effect in (0.4, 1.0))
    assert weak[0].power < weak[1].power
    assert weak[0].power < strong[0].power
    assert strong[1].power >= 0.95
    assert all(point.runs == 20 and point.low <= point.power <= point.high for point in (*weak, *strong))


@pytest.mark.long
def test_people_who_feel_nothing_are_found_at_the_rate_of_alpha(lab):
    (point,) = power_curve(asking(lab, effect=0.0, alpha=0.2), [8], 80)
    assert point.low <= 0.2 <= point.high


@pytest.mark.long
def test_the_curve_depends_neither_on_the_processes_nor_on_the_other_sizes(lab):
    one = power_curve(asking(lab, effect=0.5), [4, 6], 6)
    assert power_curve(asking(lab, effect=0.5), [6, 4], 6, jobs=2) == one
    assert power_curve(asking(lab, effect=0.5), [4], 6) == one[:1]


def test_a_run_without_a_p_finds_nothing_and_says_why(lab):
    folder = lab / "studies" / "pairs"
    study = (folder / "study.yaml").read_text()
    (folder / "study.yaml").write_text(study.replace("noise_sd: 10", "noise_sd: 0").replace("height: 8", "height: 0"))
    (point,) = power_curve(asking(lab), [4], 10)
    assert (point.found, point.undefined) == (0, 10)
    assert "undefined" in point.why


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"test": "texture"}, "no test 'texture'; did you mean 'textures'"),
        ({"outcome": "Rogh"}, "no outcome 'Rogh'; did you mean 'Rough'"),
    ],
)
def test_a_mistake_is_named(lab, change, message):
    with pytest.raises(PowerError, match=message):
        check_request(replace(asking(lab), **change))


def test_the_row_and_the_column_that_decide_are_chosen_by_name():
    rows = ({"a": "x", "b": "y", "p": 0.5, "p_corr": 0.9}, {"a": "x", "b": "z", "p": 0.01, "p_corr": 0.02})
    answer = Answer(rows, "t", {}, 4, 8)
    assert p_of(answer, "pairs") == (0.9, "", "x, y: p_corr")
    assert p_of(answer, "pairs", "z") == p_of(answer, "pairs", "z, x") == (0.02, "", "x, z: p_corr")
    assert p_of(answer, "pairs", "z", "p") == (0.01, "", "x, z: p")
    with pytest.raises(PowerError, match="no row with 'w'"):
        p_of(answer, "pairs", "w")
    with pytest.raises(PowerError, match=r"2 rows hold 'x' \(x, y; x, z\)"):
        p_of(answer, "pairs", "x")
    with pytest.raises(PowerError, match="no column 'p_cor'; did you mean 'p_corr'"):
        p_of(answer, "pairs", column="p_cor")
    with pytest.raises(PowerError, match="retest: this test has no p value"):
        p_of(Answer(({"measure": "Pearson r", "value": 0.8},), "t", {}, 4, 8), "retest")
    with pytest.raises(PowerError, match="the row .y. has no p value"):
        p_of(Answer(({"a": "x", "p": 0.5}, {"a": "y"}), "t", {}, 4, 8), "mixed", "y")
    scale = Answer(({"a": "x"},), "t", {}, 4, 8, more={"differences": ({"a": "x", "b": "y", "p": 0.5},)})
    with pytest.raises(PowerError, match="'x' has no p value.*; name a row that has one with --row, as 'x, y'"):
        p_of(scale, "scale", "x")
    with pytest.raises(PowerError, match="name the column of its p value with --p; known: p_deviance"):
        p_of(Answer(({"a": "x", "p_deviance": 0.5},), "t", {}, 4, 8), "ordinal")


def test_an_intercept_is_no_effect_and_a_models_own_tests_are_found():
    rows = ({"effect": "(Intercept)", "p": 1e-9}, {"effect": "method[AR]", "p": 0.3})
    answer = Answer(rows, "t", {}, 4, 8, more={"tests": ({"Source": "method", "p_unc": 0.04},)})
    assert p_of(answer, "model")[:2] == (0.3, "")
    assert p_of(answer, "model", "method") == (0.04, "", "method: p_unc")


@pytest.mark.long
@pytest.mark.parametrize("kind", ["friedman, factor: stimulus", "mixed_model, fixed: [stimulus]"])
def test_a_plans_rank_test_and_model_have_a_power(lab, kind):
    plan = lab / "studies" / "pairs" / "analysis.yaml"
    plan.write_text(PLAN + f"  - {{name: other, test: {kind}}}\n")
    (point,) = power_curve(replace(asking(lab, effect=0.0), test="other"), [6], 10)
    assert point.undefined == 0 and point.power < 0.5


def test_two_seeds_share_no_simulated_study(lab):
    one, other = (
        [one_run((asking(lab, seed=seed), (4,), run))[4][0] for run in range(3)] for seed in (0, 1)
    )  # fmt: skip
    assert not set(one) & set(other)


THRESHOLDS = """
study: pairs
task: intervals
stimuli: [{id: f40, frequency_hz: 40}, {id: f250, frequency_hz: 250}]
intervals: {seconds: 0.5}
procedure:
  kind: questplus
  level: {column: level_db, from: -40, to: 0, points: 21}
  model: {scale: db, threshold: {from: -40, to: 0, points: 21}, slope: [2, 3, 4], guess: 0.5}
  stop: {trials: 24}
order: {design: random}
simulation: {observer: {threshold: {f40: -12, f250: -24}, threshold_sd: 2, scale: db}}
"""
THRESHOLD_PLAN = """
study: pairs
tests:
  - {name: textures, test: psychometric, source: choices, level_unit: db}
  - {name: sensitivity, test: dprime}
"""


@pytest.fixture
def thresholds(lab):
    folder = lab / "studies" / "pairs"
    (folder / "study.yaml").write_text(THRESHOLDS)
    (folder / "analysis.yaml").write_text(THRESHOLD_PLAN)
    return lab


def test_a_difference_of_thresholds_between_tracks_has_a_power(thresholds):
    """12 dB between the tracks, of people with an SD of 2 dB: found in each study; without it hardly ever."""
    (with_it,), (without,) = (power_curve(asking(thresholds, effect=effect), [5], 4) for effect in (1.0, 0.0))
    assert with_it.by == "threshold, f40, f250: p_corrected"
    assert (with_it.power, with_it.undefined) == (1.0, 0)
    assert without.power < 1.0
    jnd = one_run((asking(thresholds, row="jnd,f40,f250"), (4,), 0))[4]
    assert jnd.by == "jnd, f40, f250: p_corrected"


def test_sensitivity_has_a_power(thresholds):
    found = one_run((replace(asking(thresholds), test="sensitivity"), (4,), 0))[4]
    assert found.by == "dprime, f40, f250: p_corrected" and found.p is not None


COMPARISONS = """
study: pairs
task: intervals
stimuli: [{id: bare, finger: bare}, {id: gloved, finger: gloved}]
intervals: {seconds: 0.5, standard: 2.0}
procedure: {kind: constant, level: {column: height, values: [1.4, 1.8, 2.0, 2.2, 2.6]}, repeats: 8}
order: {design: random}
simulation: {observer: {threshold: {bare: 2.0, gloved: 2.4}, shape: gaussian, slope: 6, guess: 0.01, threshold_sd: 0.1}}
"""


def test_an_outcome_is_refused_where_no_ratings_are_asked(lab):
    folder = lab / "studies" / "pairs"
    (folder / "study.yaml").write_text(COMPARISONS)
    (folder / "analysis.yaml").write_text("study: pairs\ntests:\n  - {name: textures, test: dprime}\n")
    with pytest.raises(PowerError, match="--outcome rough: it is about choices, not ratings; leave it out"):
        check_request(asking(lab, outcome="rough"))


def test_the_difference_of_conditions_decides_of_a_binomial_mixed_model(lab):
    """Not the slope of the first condition, which every study finds; --row names it, or the difference of slopes."""
    folder = lab / "studies" / "pairs"
    (folder / "study.yaml").write_text(COMPARISONS)
    plan = "{name: textures, test: binomial_mixed_model, random: intercept, condition: track}"
    (folder / "analysis.yaml").write_text(f"study: pairs\ntests:\n  - {plan}\n")
    ((_, result),) = results_of(asking(lab), (5,), 0)
    difference, slopes = result.answer.more["differences"]
    assert p_of(result.answer, "textures") == (difference["p"], "", "bare, gloved, pse: p")
    assert p_of(result.answer, "textures", "slope,bare,gloved").p == slopes["p"]
    assert p_of(result.answer, "textures", "gloved") == (result.answer.rows[1]["p"], "", "gloved: p")
    assert difference["p"] < 1e-6 < slopes["p"]  # 0.4 apart, 0.1 between people; the slopes are equal


def test_a_row_without_a_text_is_named_by_its_column():
    assert p_of(Answer(({"condition": "", "p": 0.5},), "t", {}, 4, 8), "slopes").by == "p"


def test_a_test_without_a_p_is_refused_before_the_first_run(lab):
    plan = lab / "studies" / "pairs" / "analysis.yaml"
    plan.write_text(PLAN + "  - {name: spread, test: means, by: [stimulus]}\n")
    with pytest.raises(PowerError, match="this test has no p value, and power is how often p is at most alpha"):
        check_power(replace(asking(lab), test="spread"))


def test_an_effect_on_people_with_one_threshold_is_refused(thresholds):
    file = thresholds / "studies" / "pairs" / "study.yaml"
    file.write_text(file.read_text().replace("{f40: -12, f250: -24}", "-18"))
    with pytest.raises(PowerError, match="one threshold for all tracks"):
        check_request(asking(thresholds, effect=0.5))
    check_request(asking(thresholds))


def test_needed_is_the_first_size_from_which_on_the_power_holds():
    points = [Point(n, 10, 0, 0, share, 0, 1) for n, share in ((4, 0.85), (6, 0.7), (8, 0.9), (10, 0.95))]
    assert needed(points, 0.8).participants == 8
    assert needed(points, 0.99) is None


def test_whether_the_planned_sample_is_enough_is_reported_only_where_it_was_tested():
    refused = Point(20, 10, 0, 10, 0, 0, 1, "cells are missing")
    points = [Point(8, 10, 5, 0, 0.5, 0, 1), Point(12, 10, 9, 0, 0.9, 0, 1), refused]
    assert planned_verdict(points, 8, 0.8) == "the planned sample of 8 is not enough for power 0.8"
    assert planned_verdict(points, 12, 0.8) == "the planned sample of 12 is enough for power 0.8"
    assert "sample of 16 is not one of the simulated sizes" in planned_verdict(points, 16, 0.8)
    assert planned_verdict(points, 20, 0.8).endswith("no simulated study gave a p value: cells are missing")
    assert (suffices(points, 16, 0.8), suffices(points, 20, 0.8)) == (None, None)


def test_the_interval_of_a_share_is_wilsons():
    """Expected: R 4.2.2 prop.test(7, 20, correct = FALSE)$conf.int."""
    assert wilson(7, 20) == pytest.approx((0.181192, 0.567146), abs=1e-6)
    assert wilson(0, 20)[0] == 0.0
    assert wilson(20, 20)[1] == 1.0


@pytest.mark.parametrize(
    ("text", "sizes"),
    [("8..16/4", (8, 12, 16)), ("8..17/4", (8, 12, 16, 17)), ("5", (5,)), ("9,4", (4, 9)), ("6..6", (6,))],
)
def test_sizes_are_a_range_or_a_list(text, sizes):
    assert Numbers(2, 999, "participants").convert(text, None, None) == sizes


def test_the_verb_writes_a_table_and_a_figure(lab):
    command = ["pairs", "--lab", str(lab), "--test", "textures", "--participants", "3,8", "--runs", "10", "--jobs", "1"]
    done = CliRunner().invoke(power, [*command, "--json"])
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout.splitlines()[-1])
    assert [point["participants"] for point in content["points"]] == [3, 8]
    written = lab / "analysis" / "pairs"
    assert (written / "power_textures_x1.csv").read_text().startswith("participants,runs,found")
    assert (written / "power_textures_x1.png").is_file()
    shown = CliRunner().invoke(power, [*command, "--effect", "0.5"])
    assert "10 simulated studies" in shown.output
    assert {path.name for path in written.glob("*.csv")} == {"power_textures_x1.csv", "power_textures_x0.5.csv"}


def test_the_time_it_takes_is_reported_from_a_small_study_and_a_larger_one(lab):
    """1 s for two people and 4 s for five: 9 s for ten; the smaller size is one more test of the same people."""
    asking = PowerRequest(find("pairs", lab), lab / "studies" / "pairs" / "analysis.yaml", lab, "textures")
    clock = iter([0.0, 1.0, 10.0, 14.0]).__next__
    assert estimate_s(asking, [5, 10], runs=20, jobs=2, clock=clock) == pytest.approx((9 + 0.5) * 20 / 2)


def test_quick_simulates_twenty_studies(lab):
    command = ["pairs", "--lab", str(lab), "--test", "textures", "--participants", "3", "--quick", "--jobs", "1"]
    content = json.loads(CliRunner().invoke(power, [*command, "--json"]).stdout)
    assert [point["runs"] for point in content["points"]] == [20]


@pytest.mark.parametrize("sizes", ["1..4", "9..3", "x", "4..1000", "2..200/1", "4..8/0"])
def test_sizes_that_cannot_be_are_refused(lab, sizes):
    done = CliRunner().invoke(power, ["pairs", "--lab", str(lab), "--test", "textures", "--participants", sizes])
    assert done.exit_code == 2
    assert "--participants" in done.output
