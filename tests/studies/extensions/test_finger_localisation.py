"""The example of an own task with its own test and figure, as a lab would have it: every command, and the numbers."""

import csv
import json
import math
import shutil
import sqlite3
from contextlib import closing
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2_contingency

from palpate.command_line import _status
from palpate.devices.window.texts_study import load_study_texts, study_texts
from palpate.protocols.extensions import Lazily, used
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import read_study
from palpate.studies.extensions.check import check
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session_files import ledger_path

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "finger_localisation"
NAME = "finger_localisation"
PEOPLE = 3
AT = {"at": "2026-01-01T00:00:00+00:00"}


@pytest.fixture(scope="module")
def ran_lab(tmp_path_factory):
    """A lab with the example, in which three simulated people took part, with its collected database and report."""
    lab = tmp_path_factory.mktemp("fingers") / "lab"
    assert _status(["init", str(lab)]) == 0
    shutil.copytree(EXAMPLE, lab, dirs_exist_ok=True)
    (lab / "lab.yaml").write_text("extensions: true\n", encoding="utf-8")
    for words in (
        ["check", NAME],
        ["run", NAME, "--participant", f"P001..P00{PEOPLE}", "--simulate"],
        ["collect"],
        ["regenerate", NAME, "--check-plan"],
        ["regenerate", NAME],
    ):
        assert _status([*words, "--lab", str(lab)]) == 0, words
    return lab


@pytest.fixture
def lab(ran_lab, tmp_path):
    return shutil.copytree(ran_lab, tmp_path / "lab")


@pytest.fixture
def call(capsys):
    """Call a command in a lab; its exit code and what it prints."""

    def command(lab, *words):
        capsys.readouterr()
        status = _status([*words, "--lab", str(lab)])
        return status, "".join(capsys.readouterr())

    return command


@pytest.fixture
def statistic(ran_lab):
    """The module with the statistic, imported from the lab."""
    with used(Lazily("palpate.studies.extensions.finder:LabExtensions", ran_lab)):
        read_study(ran_lab / "studies" / NAME / "study.yaml")
        yield import_module("lab_extensions.fingers.transmitted")


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def collected(lab):
    with closing(sqlite3.connect(lab / "lab.sqlite")) as database:
        database.row_factory = sqlite3.Row
        where = "counts AND NOT practice ORDER BY session, trial"
        return [dict(row) for row in database.execute(f"SELECT * FROM fingers_answers WHERE {where}")]


def test_the_table_has_a_row_for_each_touch_with_what_was_named(ran_lab):
    rows = collected(ran_lab)
    assert len(rows) == PEOPLE * 5 * 8  # people, fingers, repeats
    assert all(row["right"] == (row["touched"] == row["named"]) and 1 <= row["sure"] <= 4 for row in rows)
    assert all(row["response_time_s"] > 0 for row in rows)


def test_the_report_has_the_numbers_that_the_collected_rows_give_by_hand(ran_lab):
    folder = ran_lab / "regenerated" / NAME
    rows, [whole] = collected(ran_lab), rows_of(folder / "tests" / "information.csv")
    assert float(whole["percent_right"]) == pytest.approx(
        100 * sum(row["right"] for row in rows) / len(rows), rel=1e-12
    )
    fingers = ["thumb", "index", "middle", "ring", "little"]
    counts = [[sum((r["touched"], r["named"]) == (i, j) for r in rows) for j in fingers] for i in fingers]
    confusions = rows_of(folder / "tests" / "information.confusions.csv")
    assert [int(row["answers"]) for row in confusions] == [n for line in counts for n in line]
    # SciPy 1.17: the G statistic of a contingency table is 2 n ln 2 times the transmitted information in bits.
    used = np.array(counts)[:, np.sum(counts, axis=0) > 0]
    g = chi2_contingency(used, correction=False, lambda_="log-likelihood").statistic
    assert float(whole["bits"]) == pytest.approx(g / (2 * len(rows) * math.log(2)), rel=1e-12)
    assert float(whole["ci_low"]) < float(whole["bits_corrected"]) < float(whole["ci_high"])
    assert len(rows_of(folder / "tests" / "information.people.csv")) == PEOPLE
    [matrix] = [row for row in rows_of(folder / "figures" / "matrix.csv") if row["touched"] == row["named"] == "ring"]
    assert float(matrix["percent"]) == pytest.approx(100 * counts[3][3] / sum(counts[3]), rel=1e-12)
    assert (folder / "figures" / "matrix.png").is_file()


def test_shipped_tests_take_the_own_table(ran_lab):
    folder = ran_lab / "regenerated" / NAME
    means = {row["touched"]: float(row["mean"]) for row in rows_of(folder / "tests" / "right.csv")}
    rows = [row for row in collected(ran_lab) if row["touched"] == "ring"]
    assert means["ring"] == pytest.approx(sum(row["right"] for row in rows) / len(rows), rel=1e-12)
    [friedman] = rows_of(folder / "tests" / "sure.csv")
    assert 0 < float(friedman["p_unc"]) <= 1


def test_the_report_names_the_extension_with_its_version_and_digest(ran_lab):
    recorded = read(ledger_path(ran_lab, NAME, "P001", 1)).header["extensions"]["fingers"]
    statistics = json.loads((ran_lab / "regenerated" / NAME / "statistics.json").read_text(encoding="utf-8"))
    assert statistics["software"]["extension fingers"] == f"1.0 (SHA-256 {recorded['sha256'][:12]})"
    report = (ran_lab / "regenerated" / NAME / "report.html").read_text(encoding="utf-8")
    assert recorded["sha256"][:12] in report


@pytest.mark.parametrize("fingers", [2, 5, 10])
def test_all_right_transmits_the_logarithm_of_the_number_of_fingers(statistic, fingers):
    """Miller & Nicely 1955: as many bits as the touches have, log2 k; Miller 1955: less (k - 1)^2 / (2 n ln 2)."""
    counts = 20.0 * np.eye(fingers)
    assert statistic.bits(counts) == pytest.approx(math.log2(fingers), rel=1e-14)
    bias = (fingers - 1) ** 2 / (2 * math.log(2) * 20 * fingers)
    assert statistic.corrected_bits(counts) == pytest.approx(math.log2(fingers) - bias, rel=1e-14)


def test_answers_that_do_not_depend_on_the_touch_transmit_nothing(statistic):
    assert statistic.bits(np.outer([4.0, 8, 12], [1, 2, 3])) == pytest.approx(0.0, abs=1e-15)


def test_a_matrix_of_two_fingers_by_hand(statistic):
    """Three of four right: 1 - H(1/4) = 3/4 log2 3 - 1 bits; one degree of freedom, eight answers."""
    counts = np.array([[3.0, 1.0], [1.0, 3.0]])
    assert statistic.bits(counts) == pytest.approx(0.75 * math.log2(3) - 1, rel=1e-14)
    by_hand = 0.75 * math.log2(3) - 1 - 1 / (16 * math.log(2))
    assert statistic.corrected_bits(counts) == pytest.approx(by_hand, rel=1e-13)
    with_a_third = np.array([[3.0, 0, 1.0], [0, 0, 0], [1.0, 0, 3.0]])  # neither touched nor named: no category
    assert statistic.corrected_bits(with_a_third) == statistic.corrected_bits(counts)


def test_the_bias_of_few_answers_is_taken_away(statistic):
    """Of 2,000 matrices of 100 answers that are independent of the touch: their bits are 0, and seem to be 0.12."""
    draws = np.random.default_rng(1).multinomial(100, np.full(25, 0.04), size=2000).reshape(-1, 5, 5).astype(float)
    raw = np.mean([statistic.bits(counts) for counts in draws])
    assert raw > 0.11 and abs(np.mean([statistic.corrected_bits(counts) for counts in draws])) < 0.01


def test_killed_after_an_event_a_session_is_resumed_to_the_same_end_and_replays(ran_lab, tmp_path, call):
    whole = read(ledger_path(ran_lab, NAME, "P001"))
    for name in ("studies", "extensions", "lab.yaml"):
        (tmp_path / name).symlink_to(ran_lab / name)
    for number, cut in enumerate(range(3, len(whole.events), 70), start=1):
        path = ledger_path(tmp_path, NAME, "P001", number)
        path.parent.mkdir(exist_ok=True)
        create(path, whole.header, AT)
        ledger = open_for_append(path, AT)
        for event in whole.events[1:cut]:
            ledger.append(event)
        ledger.connection.close()
        ledger.engine.dispose()
        ledger.lock.release()
        assert call(tmp_path, "resume", str(path), "--without-wal")[0] == 0
        assert read(path).events == whole.events, cut
    status, text = call(ran_lab, "replay")
    assert status == 0 and f"{PEOPLE} of {PEOPLE} sessions repeat exactly" in text


@pytest.mark.parametrize("form", ["csv", "bids", "psych-ds"])
def test_answers_are_exported_with_what_their_columns_mean(ran_lab, call, tmp_path, form):
    status, text = call(ran_lab, "export", NAME, "--to", str(tmp_path / "out"), f"--{form}")
    assert status == 0, text
    name = {"csv": "fingers_answers.csv", "bids": "sub-P001*_beh.tsv", "psych-ds": "*fingersanswers_data.csv"}[form]
    [file] = (tmp_path / "out").rglob(name)
    lines = file.read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(lines, delimiter="\t" if form == "bids" else ","))
    assert len([row for row in rows if row.get("named")]) == (1 if form == "bids" else PEOPLE) * (5 * 8 + 2)
    described = (path for path in (tmp_path / "out").rglob("*") if path.suffix in (".json", ".csv"))
    assert any("The finger that the participant named." in path.read_text("utf-8") for path in described)


@pytest.mark.parametrize(
    ("change", "where", "says"),
    [
        (("task: fingers.localise", "task: fingers.localize"), "study.yaml", "no 'fingers.localize' among its tasks"),
        (("thumb, index", "thumb, pinky"), "study.yaml", "finger is 'index'; one of thumb, pinky"),
        (("name: finger,", "name: which,"), "study.yaml", "a question {name: finger, kind: choice"),
        (("feedback: true", "feedbak: true"), "study.yaml", "settings.feedbak: unknown key"),
        (("fingers.transmitted", "fingers.transmited"), "analysis.yaml", "no 'fingers.transmited' among its tests"),
        (("fingers.transmitted", "finger.transmitted"), "analysis.yaml", "the extension 'finger' is not here"),
        (("value: right", "value: correct"), "analysis.yaml", "no column 'correct'"),
        (("by: [touched]", "by: [hand]"), "analysis.yaml", "the table 'fingers_answers' has no column 'hand'"),
        (("value: sure", "value: named"), "analysis.yaml", "'named' holds words, not numbers"),
    ],
)
def test_a_mistake_is_named_with_its_line(lab, call, change, where, says):
    file = lab / "studies" / NAME / where
    file.write_text(file.read_text(encoding="utf-8").replace(*change), encoding="utf-8")
    words = ("check", NAME) if where == "study.yaml" else ("regenerate", NAME, "--check-plan")
    status, text = call(lab, *words)
    assert status != 0 and says in text and f"{where}: line " in text


def test_a_plan_says_which_extension_is_missing(lab, call):
    (lab / "extensions" / "fingers").rename(lab / "extensions" / "toes")
    status, text = call(lab, "regenerate", NAME)
    assert status != 0 and "the extension 'fingers' is not here" in text


def test_power_says_what_it_cannot_do(lab, call):
    status, text = call(lab, "power", NAME, "--test", "information", "--participants", "4..5", "--runs", "10")
    assert status != 0 and "no p value" in text
    status, text = call(lab, "power", NAME, "--test", "sure", "--participants", "4..5", "--runs", "10", "--effect", "2")
    assert status != 0 and "--effect" in text


def test_every_trial_of_the_plan_touches_a_finger_that_can_be_named(statistic, ran_lab):
    study = read_study(ran_lab / "studies" / NAME / "study.yaml").study
    plan = compile_plan(study, ParticipantRow("P001", None, 0), 0)
    assert {trial.stimulus.columns["finger"] for trial in plan.trials} == set(study.ask[0].options)


@pytest.mark.needs("fonts")
def test_its_parts_keep_the_contracts_of_their_kinds(ran_lab):
    verdicts = check("fingers", ran_lab)
    assert [str(verdict) for verdict in verdicts if not verdict.ok] == []
    assert {verdict.part for verdict in verdicts} == {"fingers.localise", "fingers.transmitted", "fingers.confusions"}


def test_every_text_of_the_study_is_translated(statistic, ran_lab):
    folder = ran_lab / "studies" / NAME
    study = read_study(folder / "study.yaml").study
    words = load_study_texts(study, folder, "ko")
    assert all(" ".join(text.split()) in words for text in study_texts(study))
