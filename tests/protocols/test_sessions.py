"""Sessions of one participant: their orders by the declared rule, and the same person with other noise."""

import statistics

import pytest

from palpate.protocols.balance import certificates
from palpate.protocols.events import Ask
from palpate.protocols.plan import compile_plan
from palpate.protocols.sample import describe_sample, sample_of
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.trial import ParticipantRow
from tests.protocols.studies_for_tests import toy


def declared(rule=None, sessions=2, **changes):
    order = {"design": "williams", **({"over_sessions": rule} if rule else {})}
    return toy(**{"participants": {"planned": 4, "sessions": sessions}, "order": order, **changes})


def order(study, session, row=0, who="P001"):
    trials = compile_plan(study, ParticipantRow(who, None, row), 0, None, session).trials
    return "".join(trial.stimulus.id for trial in trials)


def test_the_rule_orders_a_later_session_and_the_first_never_changes():
    first = order(toy(), 1)
    assert {order(declared(rule), 1) for rule in (None, "same", "next_row", "mirrored")} == {first}
    assert order(declared("same"), 2) == first and order(toy(), 2) == first
    assert order(declared(), 2) == order(declared("next_row"), 2) == order(toy(), 1, row=1)
    assert order(declared("mirrored"), 2) == first[::-1] and order(declared("mirrored", 3), 3) == first
    twice = declared(order={"design": "williams", "repeats": 2})
    assert order(twice, 2)[:4] == order(toy(), 1, row=2)


def test_random_orders_differ_by_session_and_words_with_them():
    drawn = declared(order={"design": "random"})
    assert len({order(drawn, session) for session in (1, 2)}) == 2
    words = {"task": "adjective_selection", "attributes": (), "scale": None, "simulation": None}
    listed = {"words": list("abcdefgh"), "order": "random"}

    def shown(session, **changes):
        study = declared(**words, adjectives=listed, **changes)
        return compile_plan(study, ParticipantRow("P001"), 0, None, session).trials[0].form.words

    mirrored = {"order": {"design": "williams", "over_sessions": "mirrored"}}
    assert shown(2) != shown(1) and shown(2, **mirrored) == shown(1)[::-1]


@pytest.mark.parametrize(("rule", "over_all"), [("next_row", True), ("mirrored", True), ("same", True)])
def test_balance_is_certified_for_each_session_and_over_all(rule, over_all):
    people = [(ParticipantRow(f"P{n}", None, n), 0) for n in range(4)]
    balance = certificates(declared(rule), people)
    assert list(balance) == ["", "session 1", "session 2"]
    assert [certificate.sequences for certificate in balance.values()] == [8, 4, 4]
    assert [certificate.balanced for certificate in balance.values()] == [over_all, True, True]
    assert list(certificates(toy(), people)) == [""]


def test_two_people_over_two_sessions_fill_what_one_session_leaves_open():
    """In four rows of a square each stimulus stands once at each position: two people take them in two sessions."""
    people = [(ParticipantRow("P001", None, 0), 0), (ParticipantRow("P002", None, 2), 0)]
    assert certificates(declared("next_row"), people)[""].balanced
    assert not certificates(declared("same"), people)[""].balanced


def answers(study, session):
    person = Perceiver(compile_plan(study, ParticipantRow("P001"), 0, None, session))
    replies = {t.stimulus.id: person.answer(Ask(t.form, t))[0].value["answers"]["Soft"] for t in person.plan.trials}
    return person, replies


def test_session_2_is_other_noise_of_the_same_person():
    """With equal spreads of what is felt and of the noise, the retest correlation is known: 16 / (16 + 16) = 0.5."""
    stimuli = [{"id": f"s{n}", "columns": {"size": str(n)}} for n in range(1500)]
    simulation = {"latents": {"Soft": {"size": 4.0}}, "gain_sd": 0, "bias_sd": 2.0, "noise_sd": 4.0}
    study = declared(stimuli=stimuli, simulation=simulation, scale={"from": -50, "to": 50}, rest=None,
                     order={"design": "as_listed"})  # fmt: skip
    (one, first), (two, second) = answers(study, 1), answers(study, 2)
    soft = study.attributes[0]
    assert one.bias(soft) == two.bias(soft) and one.gain(soft) == two.gain(soft)
    retest = statistics.correlation([first[s] for s in first], [second[s] for s in first])
    assert retest == pytest.approx(0.5, abs=0.06)


def test_sample_minutes_and_questions_change_no_digest_and_a_rule_over_sessions_does():
    plain = compile_plan(toy(), ParticipantRow("P001"))
    sample = {"participants": {"planned": 40, "sessions": 1}, "minutes": 55, "opening": ["demographics"]}
    study = toy(opening=["demographics"])
    assert compile_plan(toy(**sample, questions=["age"]), plain.who).digest == compile_plan(study, plain.who).digest
    two = compile_plan(declared(), plain.who)
    assert two.digest != plain.digest and two.digest == compile_plan(declared("next_row"), plain.who).digest
    assert compile_plan(declared("same"), plain.who).digest == plain.digest


def test_a_sample_of_participants_is_described_in_words():
    assert describe_sample(toy()) == "" and sample_of(toy()) == {}
    groups = {"x": {"kind": ["x"]}, "y": {"kind": ["y"]}}
    study = toy(participants={"per_group": 20, "sessions": 2, "apart_days": [1, 14]}, minutes=90, groups=groups)
    description = "40 participants (20 in each group), 2 sessions 1 to 14 days apart, 90 minutes a session"
    assert describe_sample(study) == description
