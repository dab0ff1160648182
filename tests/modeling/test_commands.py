import json
import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from palpate.modeling.commands import evaluate, train
from palpate.modeling.evaluate.outputs import RESULTS
from palpate.signals.models.file import read_model
from palpate.studies.catalogue import SHIPPED
from tests.commands_for_tests import run_command, run_verb
from tests.modeling.doors.small_evaluation import small_data

pytestmark = pytest.mark.needs("torch")


@pytest.fixture
def table(tmp_path):
    """Fifteen stimuli as a table, their profiles beside it."""
    data = small_data()
    lines = ["id,door,variant,file," + ",".join(data.attributes)]
    for i, name in enumerate(data.ids):
        shutil.copy(SHIPPED / "door_ratings" / "profiles" / f"{name}.csv", tmp_path / f"{name}.csv")
        ratings = ",".join(f"{value:.4f}" for value in data.rating[i])
        lines.append(f"{name},{data.doors[i]},{data.variants[i]},{name}.csv,{ratings}")
    path = tmp_path / "doors.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def done(command, *arguments):
    return run_verb(command, "doors", *arguments)


def test_evaluate_writes_tables_figures_and_the_report_and_resumes_from_finished_jobs(table, tmp_path):
    arguments = ("--lab", tmp_path / "lab", "--data", table, "--methods", "mean,ridge,nearest", "--workers", "1")
    arguments += ("--no-figures", "--json")
    first = json.loads(done(evaluate, *arguments).stdout)
    folder = tmp_path / "lab" / "evaluated" / "doors"
    assert (folder / "report.html").stat().st_size > 20_000
    assert json.loads((folder / RESULTS).read_text())["default"] == first["default"]
    assert first["jobs_kept"] == 0
    again = json.loads(done(evaluate, *arguments).stdout)
    assert again["jobs_kept"] == again["jobs"] == first["jobs"]
    assert again["tables"]["table_5_3_mae"] == first["tables"]["table_5_3_mae"]


def test_train_writes_two_models_that_the_rig_reads_with_metrics_interval_and_run_card(table, tmp_path):
    arguments = (
        "--data",
        table,
        "--lab",
        tmp_path / "lab",
        "--forward",
        "ridge",
        "--inverse",
        "nearest",
        "--workers",
        "1",
    )
    assert "door-perception.json: ridge; MAE" in done(train, *arguments).stdout
    models = tmp_path / "lab" / "models"
    card = json.loads((models / "door-perception.json").read_text())
    assert card["interval"]["coverage"] == 0.9
    assert len(card["interval"]["half_width"]) == 7
    assert card["metrics"]["mae"] > 0
    assert card["training"]["data"]["data"] == small_digest(table)
    assert card["training"]["versions"]["numpy"]
    answers = read_model(models / "door-perception.json").run(small_data().force_N)
    assert answers.shape == (15, 7)
    assert read_model(models / "door-force.json").run([50.0] * 7).shape == (621,)


def small_digest(table):
    from palpate.modeling.doors.reading_tables import read_table

    return read_table(table).digest


def test_a_network_gets_its_learning_curve_and_its_checkpoints_go(table, tmp_path):
    arguments = (
        "--data",
        table,
        "--lab",
        tmp_path,
        "--to",
        tmp_path / "to",
        "--forward",
        "mlp",
        "--inverse",
        "nearest",
    )
    done(train, *arguments, "--quick", "--workers", "1")
    assert (tmp_path / "to" / "door-perception.history.csv").read_text().startswith("epoch,seconds,")
    assert (tmp_path / "to" / "door-perception.history.svg").stat().st_size > 1000
    jobs = tmp_path / "evaluated" / "doors" / ".jobs"
    assert len(list(jobs.glob("*.json"))) == 2 * 3, "two methods, the three folds of a quick run, nothing else"
    assert not list((jobs / "checkpoints").glob("*"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("evaluate", "doors", "--simulated", "--methods", "rigde"), "no method 'rigde'; did you mean 'ridge'?"),
        (("evaluate", "doors", "--simulated", "--methods", "backward:ridge"), "'backward' is not a direction"),
        (("evaluate", "doors", "--split", "leeky"), "leeky"),
        (("evaluate", "doors", "--lab", "{empty}"), "no session"),
        (("train", "doors", "--forward", "generator"), "no forward method 'generator'"),
        (("train", "doors", "--inverse", "search"), "'search' searches with torch and cannot be a file"),
        (("train", "doors", "--data", "nowhere.csv"), "nowhere.csv"),
        (("train", "doors", "--simulated", "--data", __file__), "one of the two is expected"),
        (("train", "doors", "--data", __file__), "test_commands.py"),
    ],
)
def test_a_mistake_is_reported_without_a_traceback(arguments, message, tmp_path):
    code, _, err = run_command(*(argument.replace("{empty}", str(tmp_path)) for argument in arguments))
    assert code == 2
    assert message in err
    assert "Traceback" not in err


def test_an_interrupted_command_says_how_to_go_on(table, tmp_path, monkeypatch):
    def stop(*_args, **_more):
        raise KeyboardInterrupt

    monkeypatch.setattr("palpate.modeling.doors.evaluation.evaluate.evaluate_doors", stop)
    arguments = ["doors", "--data", str(table), "--lab", str(tmp_path)]
    result = CliRunner().invoke(evaluate, arguments)
    assert result.exit_code == 130
    assert "run the same command again" in result.stderr


def test_help_imports_neither_torch_nor_sklearn():
    import subprocess

    code = ("import sys; from click.testing import CliRunner; from palpate.modeling.commands import train, evaluate;"
            "[CliRunner().invoke(c, ['doors', '--help']) for c in (train, evaluate)];"
            "sys.exit(bool({'torch', 'sklearn', 'joblib', 'pandas', 'scipy'} & set(sys.modules)))")  # fmt: skip
    root = Path(__file__).resolve().parents[2]
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60, cwd=root).returncode == 0
