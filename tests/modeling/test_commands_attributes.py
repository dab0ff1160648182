import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.modeling import commands_attributes
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.model_file import ModelFileError, read_model
from palpate.modeling.commands import evaluate, train
from palpate.modeling.commands_library import textures
from palpate.modeling.training import jobs
from palpate.modeling.training.refusals import JobError
from tests.commands_for_tests import run_verb
from tests.modeling.attributes.material_for_tests import simulated_material
from tests.modeling.attributes.recordings_for_tests import rated, table

pytestmark = pytest.mark.needs("torch", "librosa", "pywt", "skimage")


@pytest.fixture
def requests(monkeypatch):
    """Simulated textures in place of a lab's."""
    seen = []

    def material(request, _report):
        seen.append(request)
        return simulated_material(12, noise=0.3)

    monkeypatch.setattr(commands_attributes, "material_for", material)
    monkeypatch.setattr(
        "palpate.modeling.attributes.feature_times.feature_seconds", lambda kinds: dict.fromkeys(kinds, 0.1)
    )
    return seen


def done(group, *arguments):
    return run_verb(group, "attributes", *arguments)


def test_evaluate_resumes_from_finished_jobs_and_train_takes_its_choice(requests, tmp_path):
    arguments = ("--lab", tmp_path, "--workers", 1, "--no-ablations")
    first = json.loads(done(evaluate, *arguments, "--methods", "ridge,mean", "--no-figures", "--json").stdout)
    folder = tmp_path / "evaluated" / "attributes"
    assert (folder / "report.html").stat().st_size > 20_000
    rows = {row["method"]: row for row in first["tables"]["methods"]}
    assert rows["ridge"]["mae"] < rows["mean"]["mae"]
    assert first["jobs_kept"] == 0
    again = done(evaluate, *arguments, "--methods", "mean", "--methods", "ridge", "--no-figures")
    assert "default: ridge." in again.stdout
    assert "The thesis' network was not evaluated" in again.stdout
    assert json.loads((folder / "evaluation.json").read_text())["jobs_kept"] == first["jobs"] == 24
    written = json.loads(done(train, "--lab", tmp_path, "--method", "ridge", "--workers", 1, "--json").stdout)
    assert written["card"] == str(tmp_path / "models" / "texture-attributes.json")
    assert written["metrics"]["mae"] == pytest.approx(rows["ridge"]["mae"])
    model = read_model(tmp_path / "models")
    texture = simulated_material(12, noise=0.3).textures[0]
    assert np.abs(model.predict(texture).mean(axis=0) - texture.rated.mean).mean() < rows["mean"]["mae"]
    line = done(train, "--lab", tmp_path, "--method", "mean", "--workers", 1, "--to", tmp_path / "elsewhere").stdout
    assert "mean; MAE" in line


def test_training_says_which_method_it_takes_and_why(requests, tmp_path, monkeypatch):
    """A quick evaluation does not decide, and is not passed over in silence either."""
    arguments = ("--lab", tmp_path, "--workers", 1)
    few = ("--methods", "ridge,mean", "--no-ablations", "--no-figures")
    monkeypatch.setattr("palpate.modeling.attributes.evaluation.outputs.DEFAULT", "mean")
    output = done(train, *arguments).stdout
    assert output.startswith("training mean: the shipped default, for this lab has no evaluation that can be read.")
    done(evaluate, *arguments, *few, "--quick")
    output = done(train, *arguments).stdout
    assert output.startswith("training mean: the shipped default, for this lab's evaluation was quick: it does not")
    done(evaluate, *arguments, *few)
    whole = done(train, *arguments, "--json")
    assert json.loads(whole.stdout)["method"] == "ridge"
    assert json.loads(whole.stdout)["why"].startswith("this lab's evaluation of 12 textures: Ridge")
    assert "training ridge: this lab's evaluation of 12 textures" in whole.stderr
    assert done(train, *arguments, "--method", "mean").stdout.startswith("training mean: as it was asked for.")


@pytest.mark.long
def test_training_says_what_the_model_was_made_from(requests, tmp_path):
    arguments = ("--lab", tmp_path, "--workers", 1, "--quick")
    output = " ".join(done(train, *arguments, "--method", "ridge").stdout.split())
    for line in ("Simulated: no person rated", "A quick run, to see that", "Weights of ResNet-50: made up."):
        assert line in output
    assert "ResNet-50" not in done(train, *arguments, "--method", "tactile_svm").stdout  # it looks at no picture
    plain = json.loads(done(train, *arguments, "--method", "ridge", "--json").stdout)
    assert [line.split()[0] for line in plain["banners"]] == ["Simulated:", "A", "Weights"]


def test_a_quick_model_takes_no_other_s_place_unless_requested(requests, tmp_path):
    arguments = ("--lab", tmp_path, "--workers", 1)
    done(train, *arguments, "--quick", "--method", "mean")
    done(train, *arguments, "--quick", "--method", "ridge")  # of two quick ones the later
    done(train, *arguments, "--method", "ridge")
    card = tmp_path / "models" / "texture-attributes.json"
    whole, read = card.read_bytes(), len(requests)
    message = r"json: this model \(ridge, of 12 textures\) was not trained with --quick, .* --to, .* --replace"
    with pytest.raises(ModelFileError, match=message):
        done(train, *arguments, "--quick", "--method", "mean")
    assert (card.read_bytes(), len(requests)) == (whole, read)  # refused before anything is read
    done(train, *arguments, "--quick", "--method", "mean", "--to", tmp_path / "elsewhere")
    assert card.read_bytes() == whole
    done(train, *arguments, "--quick", "--method", "mean", "--replace")
    assert read_model(tmp_path / "models").card.method == "mean"


@pytest.mark.long
@pytest.mark.parametrize("folds", [1, 3])
def test_few_folds_are_reported_and_more_folds_reuse_them(requests, tmp_path, folds):
    arguments = ("--lab", tmp_path, "--workers", 1, "--no-ablations", "--methods", "ridge,mean")
    shown = done(evaluate, *arguments, "--folds", folds).stdout
    assert f"{folds} of 12 textures were left out, in turn from each class" in " ".join(shown.split())
    more = json.loads(done(evaluate, *arguments, "--folds", 5, "--no-figures", "--json").stdout)
    assert (more["folds"], more["jobs"], more["jobs_kept"]) == (5, 10, 2 * folds)


@pytest.mark.parametrize(("quick", "most"), [(("--quick",), 15), ((), None)])
def test_a_quick_run_reads_fifteen_textures_drawn_by_the_seed(monkeypatch, tmp_path, quick, most):
    settings = {}

    def read(_lab, **given):
        settings.update(given)
        raise MaterialError("enough.")

    monkeypatch.setattr("palpate.modeling.attributes.reading.read_material", read)
    result = CliRunner().invoke(evaluate, ["attributes", "--lab", str(tmp_path), "--seed", "7", *quick])
    assert "enough." in str(result.exception) + result.output
    assert (settings["most"], settings["seed"], settings["quick"]) == (most, 7, bool(quick))


def test_few_folds_beside_a_quick_run_are_refused(tmp_path):
    result = CliRunner().invoke(evaluate, ["attributes", "--lab", str(tmp_path), "--quick", "--folds", "3"])
    assert result.exit_code == 2 and "--quick leaves five textures out" in result.output


def test_the_options_reach_the_reader_and_the_report(requests, tmp_path):
    weights = tmp_path / "resnet50.pth"
    weights.touch()
    arguments = ("--weights", weights, "--quick", "--seed", 3, "--epochs", 7, "--workers", 1, "--methods", "mean")
    content = json.loads(done(evaluate, "--lab", tmp_path, *arguments, "--no-figures", "--json").stdout)
    assert (requests[0].weights, requests[0].quick, requests[0].lab) == (weights, True, tmp_path)
    assert (content["quick"], content["seed"], content["epochs"], len(content["tested"])) == (True, 3, 7, 5)


def test_textures_without_what_others_have_are_named_and_left_out(tmp_path, monkeypatch):
    whole = simulated_material(12, noise=0.3)
    few = replace(whole, textures=tuple(
        texture if place < 9 else replace(texture, touch={}) for place, texture in enumerate(whole.textures)
    ))  # fmt: skip
    monkeypatch.setattr(commands_attributes, "material_for", lambda _request, _report: few)
    arguments = ("--lab", tmp_path, "--workers", 1)
    output = done(evaluate, *arguments, "--methods", "mean", "--no-figures", "--no-ablations").stdout
    assert "Not used: T10, T11, T12: no recording of it can be used." in " ".join(output.split())
    written = json.loads(done(train, *arguments, "--method", "mean", "--json").stdout)
    card = read_model(Path(written["card"])).card
    assert "Not used: T10, T11, T12: no recording of it can be used." in card.notes
    assert card.learned == whole.ids[:9]


@pytest.mark.parametrize("group", [train, evaluate])
def test_an_unknown_method_is_refused_before_anything_is_read(requests, tmp_path, group):
    option = "--method" if group is train else "--methods"
    with pytest.raises(MaterialError, match="did you mean 'ridge'"):
        done(group, "--lab", tmp_path, option, "rigde")
    assert requests == []


@pytest.mark.parametrize("names", ["", " , "])
def test_no_method_at_all_is_refused(requests, tmp_path, names):
    result = CliRunner().invoke(evaluate, ["attributes", "--lab", str(tmp_path), "--methods", names])
    assert result.exit_code == 2
    assert "--methods names none; there are visuo_tactile, visuo_tactile_thesis, hv_net" in " ".join(
        result.output.split()
    )
    assert requests == []


@pytest.mark.needs("distributed")
@pytest.mark.parametrize("group", [train, evaluate])
def test_a_cluster_that_is_not_there_is_refused_before_features_are_made(tmp_path, monkeypatch, group):
    read = []
    monkeypatch.setattr("palpate.modeling.attributes.reading.read_material", lambda *_, **__: read.append(1))
    monkeypatch.setattr(jobs, "PATIENCE_S", 0.5)
    with pytest.raises(JobError, match="no Dask scheduler at tcp://127.0.0.1:9"):
        done(group, "--lab", tmp_path, "--cluster", "tcp://127.0.0.1:9")
    assert read == []


def test_ratings_without_a_folder_are_refused(tmp_path):
    table = tmp_path / "ratings.csv"
    table.touch()
    for name, given in (("--ratings", [str(table)]), ("--scale", ["1", "7"])):
        result = CliRunner().invoke(evaluate, ["attributes", name, *given])
        assert result.exit_code == 2
        assert f"{name} goes with --folder" in result.output


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["--tables", "."], "--tables goes with --folder: a folder with a table of ratings"),
        (["--folder", ".", "--trim-s", "1"], "--trim-s goes with --tables, --hatt or --cluster-data"),
        (["--folder", ".", "--tables", ".", "--hatt", "."], "--tables and --hatt: one of them is expected"),
        (["--folder", ".", "--hatt", ".", "--force-n", "1"], "give what is missing in tables: --tables is expected"),
    ],
)
def test_recordings_go_with_a_folder_s_table(given, message):
    result = CliRunner().invoke(evaluate, ["attributes", *given])
    assert result.exit_code == 2
    assert message in result.output


def test_recordings_from_elsewhere_are_described_beside_a_table_of_ratings(tmp_path):
    names = ("oak", "felt", "cork", "mesh")
    mine = rated(tmp_path / "mine", *names)
    for seed, name in enumerate(names):
        table(tmp_path / "data", name, seed=seed)
    arguments = ("--lab", tmp_path / "lab", "--folder", mine, "--tables", tmp_path / "data", "--workers", 1)
    few = ("--methods", "mean,tactile_svm", "--no-ablations", "--no-figures", "--json")
    with pytest.raises(MaterialError, match="no picture of its textures can be used; oak: recordings left out: .*trim"):
        done(evaluate, *arguments, *few)
    content = json.loads(done(evaluate, *arguments, "--trim-s", 0, *few).stdout)
    assert sorted(content["tested"]) == sorted(names)
    assert all(row["mae"] is not None for row in content["tables"]["methods"])


def test_a_library_is_made_of_recordings_from_elsewhere_too(tmp_path):
    names = ("oak", "felt", "cork", "mesh")
    mine, lab = rated(tmp_path / "mine", *names), tmp_path / "lab"
    for seed, name in enumerate(names):
        table(tmp_path / "data", name, seed=seed, seconds=1.5 if name == "mesh" else 6.0)
    recorded = ("--folder", mine, "--tables", tmp_path / "data", "--workers", 1)
    output = done(evaluate, "--lab", lab, *recorded, "--methods", "mean", "--no-ablations", "--no-figures").stdout
    assert "mesh: no recording of it can be used (recordings left out:" in " ".join(output.split())
    assert "not told" in (lab / "evaluated" / "attributes" / "report.html").read_text()  # how many people rated
    done(train, "--lab", lab, *recorded, "--method", "tactile_svm")

    def indexed(*given):
        arguments = ["index", "--lab", str(lab), "--json", *map(str, given)]
        result = CliRunner().invoke(textures, arguments, catch_exceptions=False)
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    library = indexed(*recorded)
    assert (library["rated"], library["predicted"]) == (4, 3)
    assert any(note.startswith("1 rated textures are not predicted; the model predicts") for note in library["notes"])
    assert indexed("--folder", mine)["predicted"] == 0
    assert any(note.startswith("4 rated textures are not") for note in indexed("--folder", mine)["notes"])
    shown = CliRunner().invoke(textures, ["show", "oak", "--lab", str(lab)], catch_exceptions=False).stdout
    assert "rated" in shown and "rated by" not in shown
    result = CliRunner().invoke(textures, ["index", "--lab", str(lab), "--tables", str(tmp_path / "data")])
    assert result.exit_code == 2 and "--tables goes with --folder" in result.output


def test_an_empty_lab_is_refused(tmp_path):
    message = "no recording and no picture of a texture in texture_capture or texture_photos that can be used"
    for group in (evaluate, train):
        with pytest.raises(MaterialError, match=message):
            done(group, "--lab", tmp_path, "--workers", 1)
    assert not (tmp_path / "evaluated").exists() and not (tmp_path / "models").exists()


def test_real_or_simulated_sessions_of_the_lab_are_taken_as_requested(tmp_path, monkeypatch):
    simulated = []

    def read(_lab, **options):
        simulated.append(options["simulated"])
        return simulated_material(12, noise=0.3)

    monkeypatch.setattr("palpate.modeling.attributes.reading.read_material", read)
    for sessions in ((), ("--sessions", "real"), ("--sessions", "simulated")):
        done(train, "--lab", tmp_path, "--workers", 1, "--method", "mean", *sessions)
    assert simulated == [None, False, True]
    result = CliRunner().invoke(evaluate, ["attributes", "--sessions", "real", "--folder", str(tmp_path)])
    assert result.exit_code == 2
    assert "--folder takes none of them" in result.output


def test_help_names_both_verbs():
    for group, text in ((train, "on all rated textures"), (evaluate, "by leaving each texture out once")):
        assert "attributes" in CliRunner().invoke(group, ["--help"]).output
        assert text in " ".join(CliRunner().invoke(group, ["attributes", "--help"]).output.split())


def test_a_folder_of_pictures_with_a_table_of_ratings_takes_the_labs_place(tmp_path):
    from PIL import Image

    chance, pictures = np.random.Generator(np.random.PCG64(0)), tmp_path / "pictures"
    pictures.mkdir()
    lines = ["id,category,Rough-Smooth,Flat-Bumpy,Sticky-Slippery,Hard-Soft"]
    for place in range(6):
        coarse = chance.integers(0, 256, (4 + 6 * place, 4 + 6 * place), dtype=np.uint8)
        Image.fromarray(coarse).resize((240, 240)).save(pictures / f"P{place}_01.png")
        lines.append(f"P{place},paper,{10 + 15 * place},{90 - 15 * place},50,{40 + place}")
    (pictures / "ratings.csv").write_text("\n".join(lines) + "\n")
    arguments = ("--folder", pictures, "--lab", tmp_path, "--workers", 1, "--quick", "--no-ablations", "--no-figures")
    content = json.loads(done(evaluate, *arguments, "--methods", "mean,ridge", "--json").stdout)
    rows = {row["method"]: row for row in content["tables"]["methods"]}
    assert rows["mean"]["mae"] > 0
    assert "no mfcc features" in rows["ridge"]["refused"]  # nothing was felt
    assert "random" in content["data"]["weights"]
    assert content["feature_seconds"]["resnet"] > content["feature_seconds"]["glcm"] > 0
