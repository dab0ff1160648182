"""Free text that coders have read: their tables, what is counted, how far they agree, and what is refused."""

import csv
import json

import pytest
from click.testing import CliRunner

from palpate.analysis.commands import analyse
from palpate.analysis.importing.dialects import TableRefused
from palpate.protocols.events import Ask, Reply
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from tests.analysis.exporting.labs import exported
from tests.protocols.every_task import plan_of

QUESTIONS = [{"name": "felt", "text": "What did you feel?"}, {"name": "liked", "text": "What did you like?"}]


class Writes:
    """A world in which the interview is answered."""

    def __init__(self, world, answers):
        self.world, self.answers = world, answers

    def now(self):
        return self.world.now()

    def perform(self, request):
        if isinstance(request, Ask) and request.form.name == "interview":
            return Reply({"answers": self.answers, "seconds": 1.0})
        return self.world.perform(request)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Four people; the last says nothing of what was liked."""
    path = tmp_path_factory.mktemp("lab")
    for n in range(1, 5):
        closing = ["questionnaire", "interview"]
        plan = plan_of("matching", f"P{n:03d}", closing=closing, interview=QUESTIONS, needs=())
        planned = simulated(plan.study, path)
        answers = {"felt": f"It buzzed {n}.", "liked": "" if n == 4 else "=1+1"}

        def opened(plan, t_ns, planned=planned, answers=answers):
            return Rig(Writes(planned.open(plan, t_ns).world, answers), lambda: None)

        start(path, plan, RigPlan(planned.description, planned.check, opened))
    return path


def table(path, codes, header="participant,item,codes"):
    lines = [f"P{n:03d},{item},{answer_codes}" for (n, item), answer_codes in codes.items()]
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return path


FELT = {(1, "felt"): "buzz", (2, "felt"): "buzz", (3, "felt"): "buzz", (4, "felt"): "calm"}
OTHER = {**FELT, (3, "felt"): "calm"}
LIKED = {(1, "liked"): "buzz;speed", (2, "liked"): "", (3, "liked"): "speed"}


def run(lab, *paths, options=()):
    arguments = [argument for path in paths for argument in ("--codes", str(path))]
    return CliRunner().invoke(analyse, ["toy", "--lab", str(lab), *arguments, *options], catch_exceptions=False)


def test_codes_are_counted_and_two_coders_compared(lab, tmp_path):
    ann, bob = table(tmp_path / "ann.csv", FELT | LIKED), table(tmp_path / "bob.csv", OTHER)
    content = json.loads(run(lab, ann, bob, options=["--json"]).output)
    counts = {(row["item"], row["code"], row["coder"]): row for row in content["codes"]}
    assert (counts["felt", "buzz", "ann"]["answers"], counts["felt", "buzz", "bob"]["answers"]) == (3, 2)
    assert counts["liked", "buzz", "ann"]["coded"] == 3 and counts["liked", "speed", "ann"]["people"] == 2
    assert counts["liked", "speed", "bob"] | {"coded": 0, "share": None} == counts["liked", "speed", "bob"]
    assert counts["(all)", "buzz", "ann"]["answers"] == 4 and counts["(all)", "buzz", "ann"]["people"] == 3
    kappas = {(row["item"], row["code"]): row for row in content["agreement"]}
    # By hand: 3 of 4 agreed; chance 3/4 x 2/4 + 1/4 x 2/4 = 1/2; (3/4 - 1/2) / (1 - 1/2) = 1/2.
    assert kappas["felt", "buzz"]["kappa"] == kappas["felt", "(all)"]["kappa"] == 0.5
    assert kappas["felt", "(all)"]["agreed"] == 3 and ("liked", "speed") not in kappas
    assert content["notes"] == ["bob: 3 of 7 answers were not coded (P001 liked, P002 liked, P003 liked)"]
    with (lab / "analysis/toy/codes/agreement.csv").open(newline="") as file:
        assert [row["kappa"] for row in csv.DictReader(file) if row["item"] == "felt"] == ["0.5"] * 3


def test_an_export_with_a_column_of_codes_is_a_coder_s_table(lab, tmp_path):
    exported(lab, "toy", tmp_path / "out", "csv", free_text=True)
    lines = (tmp_path / "out/answers.csv").read_text(encoding="utf-8").splitlines()
    is_answer = [",interview,felt," in line for line in lines]
    coded = [f"{line},{'codes' if n == 0 else 'x' if is_answer[n] else ''}" for n, line in enumerate(lines)]
    (tmp_path / "ann.csv").write_text("\n".join(coded), encoding="utf-8")
    printed = run(lab, tmp_path / "ann.csv").output
    assert "felt  x: 4 of 4 answers, 4 participants (ann)" in printed and "one coder" in printed


@pytest.mark.parametrize(
    ("codes", "header", "message"),
    [
        ({(9, "felt"): "x"}, None, "line 2: P009, session 1, 'felt' is not an answer in free text; did you mean"),
        ({(4, "liked"): "x"}, None, "P004, session 1, 'liked' is not an answer"),
        ({(1, "fell"): "x"}, None, "did you mean 'felt'"),
        ({(1, "felt"): "x", (2, "felt"): "X"}, None, "codes that look alike: 'X' \\(ann\\) and 'x' \\(ann\\)"),
        ({(1, "felt"): "x"}, "participant,item,remark", "a column `codes` is expected"),
    ],
)
def test_a_row_that_is_no_answer_and_codes_that_look_alike_are_refused(lab, tmp_path, codes, header, message):
    path = table(tmp_path / "ann.csv", codes, header or "participant,item,codes")
    with pytest.raises(TableRefused, match=message):
        run(lab, path)


def test_repetitions_and_options_without_effect_are_refused(lab, tmp_path):
    path = table(tmp_path / "ann.csv", FELT)
    with pytest.raises(TableRefused, match="named twice"):
        run(lab, path, path)
    with pytest.raises(TableRefused, match=r"no\.csv: no such file"):
        run(lab, tmp_path / "no.csv")
    path.write_text(path.read_text() + "P001,felt,again\n")
    with pytest.raises(TableRefused, match="line 6: P001, session 1, 'felt' appears twice"):
        run(lab, path)
    assert "--reference has no effect on codes" in run(lab, path, options=["--reference", "r"]).output
