import pytest

from palpate.devices.window.geometry import WindowError
from palpate.devices.window.texts import SHIPPED, Texts, languages, load_texts, problems, read_words
from palpate.devices.window.texts_study import check_study_texts, load_study_texts, study_texts
from palpate.protocols.study import Study

STUDY = Study.model_validate(
    {
        "study": "toy",
        "title": "A toy",
        "task": "slider_rating",
        "instructions": "Feel it.\n\nThen say how it felt.",
        "stimuli": [{"id": "a"}],
        "attributes": [{"low": "Rough", "high": "Smooth", "explanation": "Under the finger."}],
        "scale": {"from": 0, "to": 10},
        "order": {"design": "latin"},
    }
)
KOREAN = """title: 장난감
instructions: |
  느껴 보십시오.

  그리고 답하십시오.
Rough: 거친
Smooth: 매끄러운
Under the finger.: 손가락 아래에서
"""


def changed(tmp_path, change):
    file = tmp_path / "xx.yaml"
    lines = (SHIPPED / "en.yaml").read_text("utf-8").splitlines(keepends=True)
    file.write_text("".join(change(line) for line in lines), "utf-8")
    return file


def translated(tmp_path, text=KOREAN, language="ko"):
    (tmp_path / "texts").mkdir()
    (tmp_path / "texts" / f"{language}.yaml").write_text(text, "utf-8")
    return tmp_path


@pytest.mark.parametrize("language", languages())
def test_what_is_shipped_is_whole(language):
    assert problems(SHIPPED / f"{language}.yaml") == []
    assert load_texts(language)("rest_progress", done=3, total=9).count("3") == 1


def test_korean_and_english_have_the_same_keys():
    assert languages() == ("en", "ko")
    assert list(read_words(SHIPPED / "ko.yaml")) == list(read_words(SHIPPED / "en.yaml"))


def test_a_missing_key_is_named_with_its_english_text(tmp_path):
    file = changed(tmp_path, lambda line: "" if line.startswith("try_it:") else line)
    assert problems(file) == [f"{file}: the key 'try_it' is missing; in English it says 'Try it'"]
    with pytest.raises(WindowError, match="'try_it' is missing"):
        load_texts("xx", file)


def test_an_unknown_key_is_named_with_the_nearest(tmp_path):
    messages = problems(changed(tmp_path, lambda line: line.replace("rest_title:", "rest_titel:")))
    assert any("unknown key 'rest_titel'; did you mean 'rest_title'?" in problem for problem in messages)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ("{done} done", "{done}, {total} are expected, found {done}"),
        ("{done} of {all}", "found {all}, {done}"),
        ("{done of {total}", "expected"),
    ],
)
def test_placeholders_must_agree(tmp_path, wrong, says):
    messages = problems(changed(tmp_path, lambda line: line.replace("{done} of {total} done", wrong)))
    assert len(messages) == 1 and "rest_progress" in messages[0] and says in messages[0]


def test_a_text_that_is_none_is_named_with_its_line(tmp_path):
    file = changed(tmp_path, lambda line: line.replace("next: Next", "next: 3"))
    assert problems(file) == [f"{file}: line 2: next: a text is expected, found 3"]


def test_an_unknown_language_is_refused_and_a_file_of_the_labs_own_is_read(tmp_path):
    with pytest.raises(WindowError, match="no texts in language 'fr'; known: en, ko"):
        load_texts("fr")
    file = changed(tmp_path, lambda line: line.replace("next: Next", "next: Suivant"))
    assert load_texts("fr", file)("next") == "Suivant" and load_texts("fr", file).language == "fr"


def test_a_text_without_values_is_given_as_it_stands():
    assert Texts("en", {"a": "b {c}"})("a") == "b {c}"


def test_every_text_of_a_study_is_found_once():
    assert study_texts(STUDY) == ("A toy", "Feel it.\n\nThen say how it felt.", "Rough", "Smooth", "Under the finger.")


def test_a_translation_is_looked_up_by_the_source_text_whatever_its_spaces(tmp_path):
    words = load_study_texts(STUDY, translated(tmp_path), "ko")
    assert words["Rough"] == "거친" and words["A toy"] == "장난감"
    assert words["Feel it. Then say how it felt."] == "느껴 보십시오.\n\n그리고 답하십시오."


def test_the_study_as_written_needs_no_file_and_another_language_does(tmp_path):
    assert load_study_texts(STUDY, tmp_path, "en") == {}
    with pytest.raises(WindowError, match=r"texts/ko.yaml: missing"):
        load_study_texts(STUDY, tmp_path, "ko")


def test_missing_and_unknown_translations_are_named(tmp_path):
    folder = translated(tmp_path, KOREAN.replace("Smooth: 매끄러운", "Smoth: 매끄러운"))
    missing, unknown = check_study_texts(STUDY, folder)
    assert "no translation of 'Smooth'" in missing
    assert "'Smoth' is not a text of the study; did you mean 'Smooth'?" in unknown
    with pytest.raises(WindowError, match="no translation of 'Smooth'"):
        load_study_texts(STUDY, folder, "ko")


def test_a_study_without_translations_has_no_problem_and_a_broken_file_is_one(tmp_path):
    assert check_study_texts(STUDY, tmp_path) == []
    (problem,) = check_study_texts(STUDY, translated(tmp_path, "[not, a, mapping]"))
    assert "key: text on every line is expected" in problem


ASKED = Study.model_validate(
    {
        "study": "toy", "task": "intervals", "stimuli": [{"id": "A", "columns": {"hand": "left"}}],
        "intervals": {"names": ["one", "two"]},
        "procedure": {"kind": "constant", "level": {"column": "level_db", "values": [0, 1]}, "repeats": 1},
        "ask": [
            {"name": "which", "kind": "choice", "of": "intervals", "text": "Which?"},
            {"name": "why", "kind": "choice", "options": ["louder", "longer"]},
            {"name": "nice", "kind": "scale", "from": 0, "to": 1, "labels": {0: "none"}, "ends": ["bad", "good"]},
            {"name": "long", "kind": "number", "unit": "seconds"},
            {"name": "sure", "kind": "confidence", "ends": ["guess", "sure"]},
        ],
        "order": {"design": "random", "within": "block",
                  "blocks": {"by": "hand", "instructions": {"left": "Now with your left hand."}}},
    }
)  # fmt: skip
ASKED_TEXTS = (
    "Now with your left hand.", "Which?", "louder", "longer", "bad", "good", "none", "seconds", "guess", "sure", "one",
    "two",
)  # fmt: skip


def test_the_texts_of_questions_intervals_and_blocks_are_the_studys():
    assert study_texts(ASKED) == ASKED_TEXTS


def test_a_translation_without_them_is_named_text_by_text(tmp_path):
    problems_found = check_study_texts(ASKED, translated(tmp_path, "Which?: 어느 것?"))
    assert [text for text in ASKED_TEXTS if any(f"no translation of {text!r}" in one for one in problems_found)] == [
        text for text in ASKED_TEXTS if text != "Which?"
    ]


def test_the_instructions_before_a_block_may_be_translated_by_their_name(tmp_path):
    lines = "\n".join(f"'{text}': x" for text in ASKED_TEXTS[1:])
    words = load_study_texts(ASKED, translated(tmp_path, f"block left: 이제 왼손으로.\n{lines}"), "ko")
    assert words["Now with your left hand."] == "이제 왼손으로."
