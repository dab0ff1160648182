"""Precision of thresholds: the first trials of longer tracks, what people's numbers are, and widths of intervals."""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from click.testing import CliRunner

from palpate.analysis.power.commands import power
from palpate.analysis.power.curve import check_power, results_of
from palpate.analysis.power.precision import (
    Spread,
    TrackPrecision,
    all_trials,
    check_precision,
    people_needed,
    precision,
    trials_needed,
)
from palpate.analysis.power.precision_report import precision_answers
from palpate.analysis.power.request import PowerError, PowerRequest
from palpate.analysis.power.simulated_studies import people, simulated_material
from palpate.analysis.power.simulated_tracks import first_choices, measure, with_trials
from palpate.studies.catalogue import SHIPPED, read_study

QUESTPLUS = {
    "kind": "questplus",
    "level": {"column": "level_db", "from": -40, "to": 0, "points": 21},
    "model": {"scale": "db", "threshold": {"from": -40, "to": 0, "points": 21}, "slope": [2, 3, 4], "guess": 0.5},
    "stop": {"trials": 16},
}
STAIRCASE = {"kind": "staircase", "level": QUESTPLUS["level"], "start": 0, "step": [4, 2, 1], "stop": {"trials": 20}}
LIMITS = {"kind": "limits", "level": QUESTPLUS["level"], "jitter": 3, "stop": {"trials": 60, "series": 4}}
CONSTANT = {"kind": "constant", "level": {"column": "level_db", "values": [-30, -24, -18, -12, -6, 0]}, "repeats": 4}
STUDY = {
    "study": "tracks",
    "task": "intervals",
    "stimuli": [{"id": "f40", "frequency_hz": 40}, {"id": "f250", "frequency_hz": 250}],
    "intervals": {"seconds": 0.5},
    "procedure": QUESTPLUS,
    "order": {"design": "random"},
    "simulation": {"observer": {"threshold": {"f40": -12, "f250": -24}, "threshold_sd": 2, "scale": "db"}},
}
PLAN = {
    "study": "tracks",
    "tests": [
        {
            "name": "functions",
            "test": "psychometric",
            "source": "choices",
            "level_unit": "db",
            "function": "weibull_db",
        },
        {"name": "pooled", "test": "psychometric", "source": "choices", "by": ["track"]},
        {"name": "sensitivity", "test": "dprime"},
    ],
}


@pytest.fixture
def write(tmp_path):
    """Return a function that writes the study with changed keys, and its plan, and returns a request."""

    def write_study(**changes):
        folder = tmp_path / "studies" / "tracks"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "study.yaml").write_text(
            yaml.safe_dump({key: value for key, value in {**STUDY, **changes}.items() if value})
        )
        (folder / "analysis.yaml").write_text(yaml.safe_dump(PLAN))
        return PowerRequest(folder / "study.yaml", folder / "analysis.yaml", tmp_path, "functions")

    return write_study


@pytest.mark.parametrize(
    ("procedure", "few", "many"),
    [(QUESTPLUS, 8, 16), (STAIRCASE, 8, 20), (LIMITS, 12, 60), (CONSTANT, 2, 4)],
    ids=["questplus", "staircase", "limits", "constant"],
)
def test_the_first_choices_of_longer_tracks_are_those_of_shorter_ones(write, tmp_path, procedure, few, many):
    """Every column of a session that was really run with the smaller number, its catch trials included.

    But for `seq`, the number of the event: a track that ends there has one more, its estimate.
    """
    request = write(procedure=procedure, intervals={"seconds": 0.5, "catch": {"easy": {"every": 4}}})
    study = read_study(request.study_file).study
    longer, shorter = (
        simulated_material(with_trials(study, trials), tmp_path, people(2), 3).choices for trials in (many, few)
    )
    assert len(longer) > len(shorter) > 0
    first = first_choices(longer, with_trials(study, few))
    pd.testing.assert_frame_equal(first.drop(columns="seq"), shorter.drop(columns="seq"))


def test_a_persons_own_threshold_is_the_one_that_is_estimated(write):
    """People who differ by 6 dB (SD) and have a steep function: their estimates lie within a step of 2 dB of it."""
    observer = {"threshold": -18, "threshold_sd": 6, "slope": 20, "lapse": 0, "scale": "db"}
    model = {**QUESTPLUS["model"], "slope": [10, 20]}
    request = write(procedure={**QUESTPLUS, "model": model}, simulation={"observer": observer})
    measured = [one for number in (1, 2, 3) for one in measure((request, (40,), number))[40]]
    assert np.ptp([one.truth for one in measured]) > 6
    assert all(abs(one.error) < 2 for one in measured)
    assert all(one.between == pytest.approx(6) for one in measured)


def test_the_own_threshold_is_at_the_plans_share(write):
    """F = .9 of a Weibull function in dB lies 20 log10(-ln .1) / 3 above its threshold: exact arithmetic."""
    request = write()
    plan = yaml.safe_load(request.plan_file.read_text())
    plan["tests"].append({**plan["tests"][0], "name": "at_90", "threshold": 0.9})
    request.plan_file.write_text(yaml.safe_dump(plan))
    own, at_90 = (measure((replace(request, test=name), (40,), 1))[40][0] for name in ("functions", "at_90"))
    assert at_90.truth - own.truth == pytest.approx(20 * math.log10(-math.log(0.1)) / 3)


def test_jnds_around_a_standard_are_of_the_observers_slope():
    """x.84 - x.50 of a cumulative normal with slope 6 is 1/6 (roughness_discrimination), for every person."""
    folder = SHIPPED / "roughness_discrimination"
    request = PowerRequest(folder / "study.yaml", folder / "analysis.yaml", folder, "functions", row="jnd")
    (one,) = measure((request, (4,), 1))[4]
    assert one.truth == pytest.approx(1 / 6)
    assert one.between == pytest.approx(0)


def test_no_precision_is_offered_for_pairs_which_have_no_thresholds(write):
    pairs = {
        "stimuli": [{"id": "a", "um": 1}, {"id": "b", "um": 2}],
        "pairs": {"orders": "one"},
        "intervals": {"design": "oddity"},
    }
    asked = {"ask": [{"name": "odd", "kind": "choice", "of": "intervals"}]}
    request = write(**pairs, **asked, procedure=None, simulation={"latents": {"odd": {"um": 1}}})
    with pytest.raises(PowerError, match="sensitivity: it has no p value, since it compares no two tracks$"):
        check_power(replace(request, test="sensitivity"))


def test_people_who_guess_have_no_number_and_inattentive_ones_are_left_out(write):
    observer = {"threshold": 40, "scale": "db", "lapse": 0}
    request = write(simulation={"observer": observer})
    assert {one.without for one in measure((request, (16,), 1))[16]} == {"guessing"}
    catch = {"easy": {"every": 4}, "exclude_above": 0.0}
    request = write(simulation={"observer": observer}, intervals={"seconds": 0.5, "catch": catch})
    assert {one.without for one in measure((request, (16,), 1))[16]} == {"left out"}


def test_more_trials_measure_a_person_more_exactly(write):
    """The SD after 24 trials is about twice that after 80; the study's own 16 are added and marked."""
    found = precision(write(), [24, 80], [4, 9], 10, planned=9)
    by_trials = {(point.track, point.trials): point for point in found.tracks}
    assert set(by_trials) == {(track, trials) for track in ("f40", "f250") for trials in (16, 24, 80)}
    assert {point.trials for point in found.tracks if point.own} == {16}
    for track in ("f40", "f250"):
        few, many = by_trials[track, 24], by_trials[track, 80]
        assert many.sd < few.sd and many.interval < few.interval
        assert many.sd_low < many.sd < many.sd_high
        assert (many.used, many.people, many.without) == (80, 10, 0)
        assert abs(many.bias) < 4 * many.bias_se
        assert many.covered >= 0.75
    assert {point.of for point in found.means} == {"f40", "f250", "f40 − f250"}
    assert {point.participants for point in found.means if point.planned} == {9}
    difference = found.spreads["f40 − f250", 80]
    assert difference.between == pytest.approx(2 * math.sqrt(2))  # two independent deviations with an SD of 2


@pytest.mark.long
def test_the_width_of_a_mean_is_that_of_simulated_studies(write):
    """The root mean square width of the plan's own intervals in 20 studies of 8 people: 140 degrees of freedom."""
    request = write()
    predicted = next(
        point.width for point in precision(request, [16], [8], 40).means if (point.of, point.own) == ("f40", True)
    )
    widths = []
    for run in range(20):
        ((_, result),) = results_of(request, (8,), run + 1000)
        row = next(r for r in result.answer.more["summary"] if (r["track"], r["quantity"]) == ("f40", "threshold"))
        widths.append(row["ci_high"] - row["ci_low"])
    assert math.sqrt(np.mean(np.square(widths))) == pytest.approx(predicted, rel=0.2)


def test_widths_are_students():
    """Expected: R 4.2.2, 2 * qt(.975, 9) / sqrt(10), sqrt(qchisq(.8, 9) / 9) and 2 * qt(.975, 18) * sqrt(2 / 10)."""
    one = Spread(0.6, 0.8, 1.0)
    assert one.width(10) == pytest.approx(1.4307138, abs=1e-6)
    assert one.width(10, assured=True) / one.width(10) == pytest.approx(1.1662935, abs=1e-6)
    assert one._replace(groups=2).width(20) == pytest.approx(1.8791216, abs=1e-6)
    assert one._replace(measured=0.5).width(20) == one.width(10)
    assert one._replace(measured=0.1).width(10) is None


def test_the_smallest_number_that_meets_a_target_is_named():
    spread = Spread(0.6, 0.8, 1.0)
    size = people_needed(spread, 1.5)
    assert spread.width(size, assured=True) <= 1.5 < spread.width(size - 1, assured=True)
    assert people_needed(spread, 0.001) is None
    tracks = [point(trials, sd) for trials, sd in ((10, 1.9), (20, 2.1), (30, 1.4), (40, 1.2))]
    assert (trials_needed(tracks, 2.0, "sd"), trials_needed(tracks, 1.0, "sd")) == (30, None)
    assert trials_needed([*tracks, point(40, None)], 2.0, "sd") is None


def point(trials, sd):
    return TrackPrecision("f40", trials, False, trials, 9, 0, 0, sd, sd, sd, sd, 1, 0, 0, 0, 0)


def test_without_numbers_of_trials_those_around_the_studys_are_taken(write):
    study = read_study(write().study_file).study
    assert all_trials(study, []) == (8, 12, 16, 24, 32)
    assert all_trials(study, [4, 64]) == (4, 16, 64)


def test_a_test_without_a_p_is_refused_before_the_first_run_with_the_command_that_plans_it(write):
    request = write(stimuli=STUDY["stimuli"][:1], simulation={"observer": {"threshold": -12, "scale": "db"}})
    for name in ("functions", "sensitivity"):
        with pytest.raises(PowerError, match="compares no two tracks; plan .* palpate power tracks --test functions"):
            check_power(replace(request, test=name))


@pytest.mark.parametrize(
    ("changes", "test", "message"),
    [
        (
            {},
            "sensitivity",
            r"analysis.yaml: test 'sensitivity' \(dprime\) gives no thresholds; its tests of thresholds",
        ),
        ({}, "pooled", "test 'pooled': by: found track; a person's threshold in a track needs participant and track"),
        ({"simulation": {"noise_sd": 1.0}}, "functions", r"study.yaml: the study does not say how .* \(simulation:\)"),
    ],
)
def test_what_has_no_thresholds_is_refused_with_its_place(write, changes, test, message):
    with pytest.raises(PowerError, match=message):
        check_precision(replace(write(**changes), test=test))


def test_a_study_without_a_procedure_has_no_trials_to_plan(tmp_path):
    folder = SHIPPED / "texture_similarity"
    command = ["texture_similarity", "--lab", str(tmp_path), "--test", "methods", "--trials", "24"]
    done = CliRunner().invoke(power, command)
    assert isinstance(done.exception, PowerError)
    assert f"{folder / 'study.yaml'}: no procedure" in str(done.exception)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--trials", "0,16"], "'--trials': '0,16': from 1 to 2000 trials"),
        (["--trials", "2001"], "'--trials': '2001': from 1 to 2000 trials"),
        (["--trials", "64..8"], "'--trials': '64..8': the smallest number is expected first"),
        (["--trials", "16", "--effect", "0.5"], "--effect: found together with --trials"),
    ],
)
def test_options_that_cannot_be_are_refused(write, tmp_path, option, message):
    write()
    done = CliRunner().invoke(power, ["tracks", "--lab", str(tmp_path), "--test", "functions", *option])
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())


def test_the_verb_writes_both_tables_and_a_figure_and_names_what_meets_the_targets(write, tmp_path):
    write()
    command = ["tracks", "--lab", str(tmp_path), "--test", "functions", "--trials", "40", "--participants", "4,9"]
    command += ["--runs", "10", "--jobs", "1", "--sd", "20", "--width", "6"]
    done = CliRunner().invoke(power, command)
    assert done.exit_code == 0, done.output
    assert "16*" in done.output and "a person's SD of at most 20: from 16 trials on" in done.output
    written = tmp_path / "analysis" / "tracks"
    tables = {name: pd.read_csv(written / f"precision_functions_{name}.csv") for name in ("trials", "participants")}
    assert tables["trials"]["trials"].tolist() == [16, 16, 40, 40]
    assert tables["participants"].groupby(["of", "trials"]).size().tolist() == [2] * 6
    assert (written / "precision_functions.png").is_file()


@pytest.mark.long
def test_the_verb_answers_as_json(write, tmp_path):
    write()
    command = ["tracks", "--lab", str(tmp_path), "--test", "functions", "--sd", "9", "--runs", "10", "--jobs", "1"]
    content = json.loads(CliRunner().invoke(power, [*command, "--json"]).stdout)
    assert (content["quantity"], len(content["tracks"])) == ("threshold", 2 * 5)  # the trials around the study's own
    assert content["answers"] == ["a person's SD of at most 9: from 12 trials on"]


def test_targets_that_are_not_reached_say_so(write):
    found = precision(write(), [16], [4], 5)
    sd, interval, *widths = precision_answers(found, 0.01, 0.01)
    assert sd == "a person's SD of at most 0.01: not reached with 16 trials"
    assert interval.endswith("not reached with 16 trials")
    assert all(line.endswith("not reached with 999 participants") for line in widths)


GROUPS = {
    "stimuli": [{**one, "finger": name} for one, name in zip(STUDY["stimuli"], ("index", "thumb"), strict=True)],
    "groups": {name: {"finger": [name]} for name in ("index", "thumb")},
}


def test_participants_without_a_track_do_not_narrow_the_interval_of_its_mean(write):
    """Two groups have a track each: of ten participants five have it, and the groups are compared in none."""
    request = write(**GROUPS)
    planned = precision(request, [16], [10], 8)
    measured = {point.track: point.people * (1 - point.without) / 8 for point in planned.tracks}
    assert {point.of: point.measured for point in planned.means} == measured and max(measured.values()) <= 0.5
    assert all(
        point.width == planned.spreads[point.of, 16]._replace(measured=1.0).width(10 * point.measured)
        for point in planned.means
    )


def test_people_whom_the_test_does_not_ask_about_have_no_measurement(write):
    request = write(**GROUPS)
    plan = yaml.safe_load(request.plan_file.read_text())
    plan["tests"][0]["where"] = {"group": "index"}
    request.plan_file.write_text(yaml.safe_dump(plan))
    (track,) = precision(request, [16], [10], 4).tracks
    assert (track.track, track.people) == ("f40", 2)
    plan["tests"][0]["where"] = {"track": "f41"}
    request.plan_file.write_text(yaml.safe_dump(plan))
    with pytest.raises(PowerError, match="`where` keeps no choice of any simulated person"):
        precision(request, [16], [10], 2)


def test_groups_may_have_tracks_of_one_name_with_levels_of_their_own(write):
    """Levels are stimuli, three for one group and two for the other: with one repeat a track has as many trials."""
    finger = {"s": "no", "a": "index", "b": "index", "c": "index", "d": "thumb", "e": "thumb"}
    request = write(
        stimuli=[{"id": name, "um": n + 1, "finger": finger[name]} for n, name in enumerate("sabcde")],
        groups={"index": {"finger": ["index"]}, "thumb": {"finger": ["thumb"]}},
        intervals={"standard": "s"},
        procedure={"kind": "constant", "level": {"column": "um", "of": "stimuli"}, "repeats": 4},
        simulation={"observer": {"threshold": 3, "shape": "logistic", "scale": "linear"}},
    )
    used = {number: measure((request, (1, 4), number))[1][0].used for number in (1, 2)}
    assert sorted(used.values()) == [2, 3]
