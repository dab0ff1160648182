import json

import pytest

from palpate.protocols.forms import Demographics, Question
from palpate.studies.lab import ParticipantError
from palpate.studies.participants.sidecar import columns, identifying, questions, sidecar_file

BARE = {"participant_id": {"Description": "Pseudonym"}}


def broken(tmp_path, text):
    (tmp_path / "participants.json").write_text(text if isinstance(text, str) else json.dumps(text), "utf-8")
    return tmp_path


def test_a_new_lab_asks_what_the_field_reports(home):
    by_name = {question.name: question for question in questions(home.lab)}
    assert list(by_name) == ["age", "gender", "handedness", "driving_experience", "took_part_before"]
    assert by_name["age"] == Question("age", "How old are you?", "number", (), "years", 0, 120, True)
    assert by_name["gender"].levels == (("F", "Woman"), ("M", "Man"), ("X", "Another gender"))
    assert questions(None) == questions(home.lab)
    form = Demographics(tuple(by_name.values()))
    assert form.problem({"age": 27, "gender": "X", "handedness": "left", "driving_experience": 2.5,
                         "took_part_before": None}) is None  # fmt: skip
    assert "age" in form.problem({**dict.fromkeys(by_name), "age": 200})


def test_every_question_of_the_template_is_asked_in_korean_too():
    english, korean = questions(None), questions(None, "ko")
    assert [(k.name, k.kind, [v for v, _ in k.levels]) for k in korean] == [
        (e.name, e.kind, [v for v, _ in e.levels]) for e in english
    ]
    texts = [text for question in korean for text in (question.text, *(label for _, label in question.levels))]
    assert all(any("가" <= letter <= "힣" for letter in text) for text in texts)


def test_a_column_without_a_question_is_not_asked_and_its_keys_say_of_what_kind_it_is(tmp_path):
    lab = broken(tmp_path, {
        **BARE,
        "vision": {"Description": "Acuity", "Units": "logMAR"},
        "hobby": {"Question": "What do you like?"},
        "cups": {"Question": "Cups a day?", "Minimum": 0, "Optional": False},
        "skin": {"Question": "Skin?", "Levels": {"dry": {"Description": "Dry"}, "oily": "Oily"}},
    })  # fmt: skip
    by_name = {question.name: (question.kind, question.optional, question.low) for question in questions(lab)}
    assert by_name == {"hobby": ("text", True, None), "cups": ("number", False, 0), "skin": ("choice", True, None)}
    assert questions(lab)[2].levels == (("dry", "Dry"), ("oily", "Oily"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", r"participants\.json: line 1, column 2: this is not JSON"),
        ("[]", 'an object with "participant_id" as its first key is expected'),
        ({"age": {}, **BARE}, '"participant_id" as its first key'),
        ('{"participant_id": {}, "age": {}, "age": {}}', "the key 'age' appears twice"),
        ({**BARE, "age": "years"}, "age: found 'years', an object with Description"),
        ({**BARE, "gender": {"Levels": ["F", "M"]}}, r"gender\.Levels: found \['F', 'M'\], an object is expected"),
        ({**BARE, "gender": {"Levels": {}}}, r"gender\.Levels: found \{\}, an object"),
        ({**BARE, "gender": {"Levels": {"F": 1}}}, r"gender\.Levels: found"),
        ({**BARE, "age": {"Minimum": "0"}}, r"age\.Minimum: found '0', a number is expected"),
        ('{"participant_id": {}, "age": {"Minimum": NaN}}', r"participants\.json: NaN is not JSON; a finite number"),
        ({**BARE, "age": {"Minimum": 5, "Maximum": 1}}, r"age: Minimum \(5\) is above Maximum \(1\)"),
        ({**BARE, "age": {"Question": ""}}, r"age\.Question: found '', a text is expected"),
        ({**BARE, "age": {"Questoin": "?"}}, r"age\.Questoin: unknown key; did you mean 'Question'\?"),
        ({**BARE, "age": {"Question": "?", "Optional": "no"}}, r"age\.Optional: found 'no', true or false"),
        ({**BARE, "Driving years": {}}, "Driving years: a column's name in snake_case is expected"),
        ({**BARE, "first_name": {}}, "first_name: a column about 'name' would identify a person"),
    ],
)
def test_a_broken_file_is_refused_with_file_key_and_expectation(tmp_path, text, message):
    with pytest.raises(ParticipantError, match=message) as caught:
        questions(broken(tmp_path, text))
    assert str(tmp_path / "participants.json") in str(caught.value)


def test_a_file_that_is_not_utf_8_is_refused(tmp_path):
    (tmp_path / "participants.json").write_bytes(b'{"participant_id": {"Description": "\xff"}}')
    with pytest.raises(ParticipantError, match="byte 36 is not UTF-8"):
        questions(tmp_path)


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ({"Question": "Age?"}, r"age\.Question_ko: missing; a translation of Question is expected"),
        ({"Question": "?", "Question_ko": "?", "Units": "years"}, r"age\.Units_ko: missing"),
        ({"Question": "?", "Question_ko": "?", "Levels": {"a": "A", "b": "B"}, "Levels_ko": {"a": "가"}},
         r"age\.Levels_ko: the same levels as in Levels are expected \(b\)"),
    ],
)  # fmt: skip
def test_a_missing_translation_is_named(tmp_path, column, message):
    lab = broken(tmp_path, {**BARE, "age": column})
    assert questions(lab)[0].name == "age"
    with pytest.raises(ParticipantError, match=message):
        questions(lab, "ko")


@pytest.mark.parametrize(
    "name",
    ["name", "last_name", "surname", "email", "e_mail", "phone2", "home_address", "birth_date", "dateOfBirth", "이름",
     "생년월일", "first-name", "PatientName", "zip_code"],
)  # fmt: skip
def test_what_says_who_somebody_is_is_known_by_its_words(name):
    assert identifying(name) is not None


@pytest.mark.parametrize(
    "name", [*columns(sidecar_file(None)), "hand_length_mm", "username_free", "emailing", "shipping"]
)
def test_what_says_it_not_is_let_through(name):
    assert identifying(name) is None
