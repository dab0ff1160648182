"""Pairs of stimuli in the task intervals: which there are, what is presented, simulated choices, bad declarations."""

from collections import Counter
from itertools import combinations, permutations

import pytest

from palpate.protocols.balance import certificates
from palpate.protocols.events import Ask, Present, Reply, Show
from palpate.protocols.forms import FORMS
from palpate.protocols.pairs import Pairs, rounds_of_all, tournament
from palpate.protocols.plan import compile_plan, count_trials
from palpate.protocols.reading import StudyError, study_from
from palpate.protocols.simulated_participants import simulated_participant
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS
from palpate.protocols.trial import ParticipantRow
from palpate.protocols.yaml_text import load

ROUGHER = {"name": "rougher", "kind": "choice", "of": "intervals", "text": "Which one was rougher?"}
PAPERS = [{"id": name, "columns": {"grit": str(grit), "kind": kind}}
          for name, grit, kind in (("A", 80, "x"), ("B", 100, "x"), ("C", 120, "y"), ("D", 140, "y"))]  # fmt: skip


def study(pairs=None, **changes):
    data = {
        "study": "papers", "task": "intervals", "stimuli": PAPERS, "intervals": {"seconds": 2.0}, "ask": [ROUGHER],
        "pairs": pairs or {}, "order": {"design": "random"},
    }  # fmt: skip
    return Study.model_validate(data | changes)


def plan(pairs=None, row=0, **changes):
    return compile_plan(study(pairs, **changes), ParticipantRow("P001", None, row))


def pairs_of(compiled):
    return [tuple(stimulus.id for stimulus in trial.stimuli) for trial in compiled.trials if not trial.practice]


def gone_through(trial, chosen="1"):
    """Return the requests of a trial, with this answer."""
    steps, requests, reply = TASKS["intervals"].steps(trial), [], None
    try:
        while True:
            requests.append(request := steps.send(reply))
            reply = Reply({"answers": {"rougher": chosen}} if isinstance(request, Ask) else {})
    except StopIteration:
        return requests


def felt(requests):
    return [request.trial.stimulus.id for request in requests if isinstance(request, Present)]


def test_every_pair_comes_in_both_orders_as_often_as_repeated():
    compiled = plan(order={"design": "random", "repeats": 2})
    assert Counter(pairs_of(compiled)) == dict.fromkeys(permutations("ABCD", 2), 2)
    assert len(compiled.trials) == 24 == count_trials(compiled.study, compiled.study.stimuli)
    assert {stimulus.id for stimulus in compiled.possible} == set("ABCD")


def test_of_one_order_each_stimulus_is_first_for_half_of_the_participants_and_in_half_of_the_repeats():
    orders = [pairs_of(plan({"orders": "one"}, row)) for row in range(4)]
    for order in orders:
        assert sorted(map(sorted, order)) == sorted(map(list, combinations("ABCD", 2)))
    first = Counter(pair for order in orders for pair in order)
    assert first == dict.fromkeys(permutations("ABCD", 2), 2)
    twice = Counter(pairs_of(plan({"orders": "one"}, order={"design": "williams", "repeats": 2})))
    assert twice == dict.fromkeys(permutations("ABCD", 2), 1)


def test_pairs_stay_within_their_block_and_go_through_the_rows_of_a_square():
    order = {"design": "latin", "within": "block", "blocks": {"by": "kind"}}
    assert set(pairs_of(plan(order=order))) == {("A", "B"), ("B", "A"), ("C", "D"), ("D", "C")}
    who = [(ParticipantRow(f"P{row:03}", None, row), 0) for row in range(12)]
    for orders in ("both", "one"):
        balance = certificates(study({"orders": orders}, order={"design": "latin"}), who)[""]
        assert balance.position_range == (1, 1) if orders == "both" else (2, 2)


@pytest.mark.parametrize("size", [5, 6])
def test_rounds_of_a_tournament_connect_all_stimuli_and_have_all_pairs_equally_often_over_the_rows(size):
    names = "ABCDEF"[:size]
    assert sorted(tournament(names, 0, rounds_of_all(size))) == sorted(combinations(names, 2))
    for rounds in range(2, rounds_of_all(size)):
        times = Counter()
        for row in range(rounds_of_all(size)):
            pairs = list(tournament(names, row, rounds))
            assert len(pairs) == Pairs(orders="one", rounds=rounds).count(size)
            connected = set(names[0])
            for _ in names:
                connected |= {name for pair in pairs if set(pair) & connected for name in pair}
            assert connected == set(names)
            met = Counter(name for pair in pairs for name in pair)
            assert {met[name] for name in names} <= ({rounds} if size == 6 else {rounds - 1, rounds})
            times.update(pairs)
        assert times == dict.fromkeys(combinations(names, 2), rounds)


def test_a_part_of_the_pairs_is_presented_and_counted():
    compiled = plan({"orders": "both", "rounds": 2})
    assert len(compiled.trials) == 2 * 2 * 2 == count_trials(compiled.study, compiled.study.stimuli)
    assert all(tuple(reversed(pair)) in pairs_of(compiled) for pair in pairs_of(compiled))


def test_two_may_be_called_equal_and_then_nobody_has_won():
    compiled = plan(intervals={"equal": True})
    trial = compiled.trials[0]
    assert trial.form.choice.options == ("1", "2", "equal")
    asked, answered = gone_through(trial, "equal")[-1], {"answers": {"rougher": "equal"}, "seconds": 0.7}
    assert trial.form.problem(answered["answers"]) is None
    [row] = FORMS["intervals"].table.rows(trial.form, answered["answers"], answered, asked.body())
    assert (row["chosen"], row["alternatives"], row["hit"], row["correct"]) == ("equal", 3, None, None)
    assert plan().trials[0].form.problem(answered["answers"]) is not None


def test_simulated_people_call_those_equal_that_they_can_hardly_tell_apart():
    alike = {"latents": {"rougher": {"grit": 0.001}}, "noise_sd": 1.0}
    apart = {"latents": {"rougher": {"grit": 50.0}}, "noise_sd": 1.0}
    shares = []
    for simulation in (alike, apart):
        compiled = plan(intervals={"equal": True}, simulation=simulation, order={"design": "random", "repeats": 8})
        person = simulated_participant(compiled)
        said = [person.answer(gone_through(t)[-1])[0].value["answers"]["rougher"] for t in compiled.trials]
        shares.append(said.count("equal") / len(said))
    # two draws of one normal distribution are less than half an SD apart in 2 Phi(0.5 / sqrt(2)) - 1 = 0.276
    assert shares[0] == pytest.approx(0.276, abs=0.14) and shares[1] == 0


def test_practice_takes_the_stimuli_two_by_two():
    practised = [trial for trial in plan(practice={"stimuli": ["A", "D", "B", "C"]}).trials if trial.practice]
    assert [[stimulus.id for stimulus in trial.stimuli] for trial in practised] == [["A", "D"], ["B", "C"]]


def test_the_first_of_a_pair_is_presented_first_and_neither_choice_is_right():
    trial = plan().trials[0]
    requests = gone_through(trial, "2")
    assert felt(requests) == [stimulus.id for stimulus in trial.stimuli]
    assert [request.part.body() for request in requests[:-1]] == [{"interval": 1}, {"interval": 2}]
    asked = requests[-1]
    answered = {"answers": {"rougher": "2"}, "at_s": {"rougher": 0.7}, "seconds": 0.7}
    [row] = FORMS["intervals"].table.rows(trial.form, answered["answers"], answered, asked.body())
    first, second = felt(requests)
    assert (row["stimulus"], row["other"], row["chosen"], row["procedure"]) == (first, second, "2", "pairs")
    assert [row[name] for name in ("target", "correct", "hit", "level", "standard")] == [None] * 5


@pytest.mark.parametrize(("chosen", "right"), [("same", True), ("different", False)])
def test_equal_stimuli_are_the_same_and_others_different(chosen, right):
    settings = {"intervals": {"design": "same_different"}, "feedback": {"seconds": 0.5}}
    trials = plan({"orders": "one", "same": 2}, **settings).trials
    equal = [trial for trial in trials if len({stimulus.id for stimulus in trial.stimuli}) == 1]
    assert len(trials) == 6 + 4 * 2 and len(equal) == 8
    for trial, is_right in ((equal[0], right), (next(t for t in trials if t not in equal), not right)):
        requests = gone_through(trial, chosen)
        assert requests[-1] == Show("right_answer" if is_right else "wrong_answer", 0.5, trial)
        assert requests[-2].form.context["target"] == ("same" if trial in equal else "different")


def test_the_first_of_a_pair_is_the_odd_one_at_any_place():
    places = set()
    for trial in plan(intervals={"design": "oddity"}, order={"design": "random", "repeats": 3}).trials:
        requests = gone_through(trial)
        target = int(requests[-1].form.context["target"])
        odd, other = (stimulus.id for stimulus in trial.stimuli)
        assert felt(requests) == [odd if n == target else other for n in (1, 2, 3)]
        places.add(target)
    assert places == {1, 2, 3}


def test_two_sides_are_presented_at_once():
    trial = plan(intervals={"at_once": True}).trials[0]
    [present, _] = gone_through(trial)
    assert present.part.sides == tuple(stimulus.id for stimulus in trial.stimuli)


STUDY = """\
study: papers
stimuli: stimuli.csv
task: intervals
intervals: {{{intervals}}}
ask: [{{name: rougher, kind: choice, of: intervals, text: 'Which one was rougher?'}}]
pairs: {{{pairs}}}
order: {{design: {order}}}
{more}
"""
GOOD = {"intervals": "", "pairs": "", "order": "random", "more": ""}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"more": "procedure: {kind: constant, level: {column: grit, values: [1, 2]}, repeats: 3}"},
         "procedure: {kind, level, ...}, or pairs: {} in its place, is expected, found both"),
        ({"intervals": "design: yes_no"}, "pairs are felt in two intervals, or with design: oddity"),
        ({"intervals": "count: 3"}, "pairs are felt in two intervals, or with design: oddity"),
        ({"intervals": "standard: A"}, "pairs have no standard"),
        ({"intervals": "catch: {easy: {every: 3}}"}, "catch trials belong to procedures"),
        ({"intervals": "design: same_different"}, "same: N, pairs of equal stimuli, goes together with"),
        ({"pairs": "same: 1"}, "same: N, pairs of equal stimuli, goes together with"),
        ({"pairs": "rounds: 4"}, "pairs.rounds: 3 rounds have all pairs of 4 stimuli (main); leave rounds out"),
        ({"pairs": "rounds: 1"}, "pairs.rounds"),
        ({"intervals": "design: oddity, equal: true"}, "a further answer of pairs"),
        ({"intervals": "equal: true, names: [left, right]"}, "3 names are expected, found 2"),
        ({"pairs": "order: both"}, "pairs.order: unknown key; did you mean 'orders'?"),
        ({"more": "feedback: {after: all}"}, "which of a pair is chosen is neither right nor wrong"),
        ({"more": "practice: {stimuli: [A]}"}, "two stimuli for each pair are expected"),
        ({"more": "practice: {stimuli: [A, B], until: {correct: 1, of: 1}, at_most: 2}"},
         "practice until a goal belongs to procedures"),
        ({"more": "simulation: {observer: {threshold: 3}}"}, "pairs are judged by latents"),
        ({"more": "simulation: {latents: {softer: {grit: 1}}}"}, "found 'softer'"),
        ({"more": "needs: [door]"}, "task intervals is presented by vibration, or by samples"),
        ({"intervals": "design: same_different", "pairs": "same: 100", "order": "random, repeats: 5"},
         "2060 trials, more than 2000"),
    ],
)  # fmt: skip
def test_a_declaration_that_cannot_be_is_named(changes, message):
    text = STUDY.format(**{**GOOD, **changes})
    with pytest.raises(StudyError) as raised:
        study_from(load(text.encode(), "study.yaml"), PAPERS, "study.yaml")
    assert message in str(raised.value) and "line " in str(raised.value)


def test_the_question_about_a_pair_has_a_text():
    text = STUDY.format(**GOOD)
    study_from(load(text.encode(), "study.yaml"), PAPERS, "study.yaml")
    with pytest.raises(StudyError, match="what is asked about a pair"):
        study_from(load(text.replace(", text: 'Which one was rougher?'", "").encode(), "s"), PAPERS, "study.yaml")
    with pytest.raises(StudyError, match="two stimuli or more are expected for pairs"):
        study_from(load(text.encode(), "s"), PAPERS[:1], "study.yaml")
