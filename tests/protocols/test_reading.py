import pytest

from palpate.protocols.reading import TASK_KEYS, StudyError, study_from
from palpate.protocols.study import Scale, Study
from palpate.protocols.tasks import TASKS
from palpate.protocols.yaml_text import load
from palpate.studies.catalogue import SHIPPED

GOOD = """\
study: toy
task: slider_rating
stimuli: stimuli.csv
groups: {1: {kind: [x]}, 2: {kind: [y]}}
attributes:
  - [Soft, Hard]
  - {low: Cold, high: Warm, category: physical}
scale: {from: -10, to: 10, step: 1}
order: {design: williams, within: group}
practice: {stimuli: [A]}
rest: {every: 2}
analysis: {within: [kind], pooled: kind}
simulation:
  latents:
    Soft: {size: 1.5, intercept: 1}
"""
ROWS = [{"id": name, "columns": {"size": str(n), "kind": "xy"[n % 2]}} for n, name in enumerate("ABCD")]

WARM = "{low: Cold, high: Warm, category: physical}"


def scaled(more):
    """The study with a scale from -10 to 10 that has more to it."""
    return GOOD.replace("step: 1}", f"{more}}}")


def read(text, rows=ROWS):
    return study_from(load(text.encode(), "study.yaml"), rows, "study.yaml")


def test_a_study_is_read_and_its_definition_reads_back():
    study = read(GOOD)
    assert [a.name for a in study.attributes] == ["Soft", "Cold"]
    assert study.scale.low == -10 and type(study.scale.low) is int
    assert sorted(study.groups) == ["1", "2"]
    assert [s.id for s in study.stimuli_of("2")] == ["B", "D"]
    again = type(study).model_validate(study.definition())
    assert again.definition() == study.definition()
    assert "seed" not in study.definition()["order"]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("task: slider_rating", "taks: slider_rating", "study.yaml: line 2: taks: unknown key; did you mean 'task'?"),
        ("task: slider_rating\n", "", "study.yaml: task: this key is required"),
        (
            "slider_rating",
            "slider_ratings",
            "line 2: task: found 'slider_ratings', expected 'slider_rating', 'matching', ",
        ),
        ("design: williams", "design: willams", "line 9: order.design: found 'willams', expected 'williams', 'latin'"),
        ("design: williams", "design: willams", "did you mean 'williams'?"),
        ("within: group", "wihtin: group", "order.wihtin: unknown key; did you mean 'within'?"),
        ("from: -10", "form: -10", "scale.form: unknown key; did you mean 'from'?"),
        ("step: 1}", "step: 3}", "line 8: scale: step (3) must divide the range -10 to 10"),
        ("step: 1}", "step: -1}", "step (-1) must divide the range"),
        ("to: 10", "to: -10", "scale: from (-10) must be below to (-10)"),
        ("to: 10", "to: ten", "line 8: scale.to: found 'ten', input should be a valid"),
        ("to: 10", 'to: "10"', "scale.to: found '10', input should be a valid"),
        ("[Soft, Hard]", "[Soft, Hard, Firm]", "line 6: attributes[0]: a pair of two adjectives is expected, found 3"),
        ("high: Warm", "high: soft", "attributes[1][1]: the adjective 'soft' appears twice"),
        ("category: physical", "categorie: physical", "attributes[1].categorie: unknown key; did you mean 'category'?"),
        ("kind: [y]", "kind: [z]", "line 4: groups.2.kind[0]: found 'z', expected a level of kind; known: x, y"),
        (
            "kind: [y]",
            "knid: [y]",
            "groups.2.knid: found 'knid', expected a column of the stimulus table; did you mean 'k",
        ),
        ("kind: [y]", "kind: [y, y]", "groups.2.kind: the level of kind 'y' appears twice"),
        ("{stimuli: [A]}", "{stimuli: [a]}", "practice.stimuli[0]: found 'a', expected a stimulus id"),
        ("every: 2", "every: 0", "rest.every: found 0, input should be greater than or equal to 1"),
        ("every: 2", "every: 2.5", "rest.every: found 2.5, input should be a valid integer"),
        ("{every: 2}", "{button: false}", "rest: every: N, or button: true, or both are expected"),
        ("pooled: kind", "pooled: kin", "analysis.pooled: found 'kin'"),
        ("Soft: {size", "Sofd: {size", "simulation.latents.Sofd: found 'Sofd', expected an attribute"),
        ("{size: 1.5", "{sise: 1.5", "simulation.latents.Soft.sise: found 'sise'"),
        ("{size: 1.5", "{kind: 1.5", "stimulus 'A' has 'x' in 'kind', not a finite number"),
        ("design: williams, within: group", "design: latin, within: block", "order: within: block and blocks: {by"),
        ("study: toy", "study: my study", "study: a name of letters, digits, _ and - is expected"),
        ("study: toy", "study: 7", "study: found 7, input should be a valid string"),
    ],
)
def test_a_complaint_names_file_line_path_and_nearest_name(old, new, expected):
    assert GOOD.count(old) == 1
    with pytest.raises(StudyError) as caught:
        read(GOOD.replace(old, new))
    message = str(caught.value)
    assert expected in message
    assert all(line.startswith("study.yaml:") for line in message.splitlines())


LABELLED = "labels: {-10: Not at all, 0: Half, 10: Fully}"


@pytest.mark.parametrize(
    ("scale", "ticked"),
    [
        (LABELLED, ()),
        (f"{LABELLED}, ticks: labels", (-10.0, 0.0, 10.0)),
        ("step: 5, ticks: steps", (-10.0, -5.0, 0.0, 5.0, 10.0)),
    ],
)
def test_a_scale_may_be_labelled_and_ticked_and_is_neither_unless_the_study_says_so(scale, ticked):
    plain = read(scaled("start: unset")).definition()["scale"]
    assert plain == {"low": -10, "high": 10, "start": "unset"}, "what is not set enters no digest"
    parsed = read(scaled(scale)).scale
    assert parsed.ticked == ticked
    assert parsed == Scale.model_validate(parsed.model_dump(exclude_unset=True)) and hash(parsed), (
        "a form's scale is a key"
    )
    assert parsed.labelled in ((), ((-10.0, "Not at all"), (0.0, "Half"), (10.0, "Fully")))


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        ("labels: {11: Too far}", "labels: 'Too far' stands at 11, which is not a value of the scale"),
        ("step: 5, labels: {3: Between}", "labels: 'Between' stands at 3, which is not a value"),
        ("labels: {left: Left}", "labels: 'left' is not a value of the scale"),
        ("labels: {1: One, '1.0': Uno}", "labels: two labels stand at one value"),
        ("ticks: labels", "ticks: labels needs labels"),
        ("ticks: steps", "ticks: steps needs a step"),
        ("step: 0.1, ticks: steps", "of at most 100 on the line"),
    ],
)
def test_a_label_off_the_scale_and_ticks_of_nothing_are_refused(scale, message):
    with pytest.raises(StudyError) as caught:
        read(scaled(scale))
    assert message in str(caught.value)


def test_an_attribute_may_have_a_name_of_its_own_and_then_share_its_words_with_others():
    pairs = "[Soft, Hard]", "{low: Not at all, high: Very, name: Warmth}"
    study = read(GOOD.replace(pairs[0], "{low: Not at all, high: Very, name: Soft}").replace(WARM, pairs[1]))
    assert [attribute.name for attribute in study.attributes] == ["Soft", "Warmth"]
    assert Study.model_validate(study.definition()) == study
    with pytest.raises(StudyError, match=r"attributes: the name 'Soft' appears twice"):
        read(GOOD.replace(WARM, "{low: Cold, high: Warm, name: Soft}"))


def test_many_problems_fit_on_a_screen():
    text = GOOD + "".join(f"unknown{i}: 1\n" for i in range(30))
    with pytest.raises(StudyError) as caught:
        read(text)
    lines = str(caught.value).splitlines()
    assert len(lines) == 9 and lines[-1] == "... and 22 more"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([*ROWS, ROWS[0]], "line 3: stimuli: the stimulus id 'A' appears twice"),
        ([], "stimuli: "),
        ([*ROWS, {"id": "E", "columns": {"kind": "x"}}], "not every stimulus has the column 'size'"),
        ([*ROWS, {"id": "E", "columns": {"kind": "x", "size": "inf"}}], "stimulus 'E' has 'inf' in 'size'"),
    ],
)
def test_a_bad_stimulus_table_is_refused(rows, message):
    with pytest.raises(StudyError) as caught:
        read(GOOD, rows)
    assert message in str(caught.value)


def test_a_group_without_stimuli_is_refused():
    text = GOOD.replace("kind: [y]", "kind: [y], size: [0]")
    with pytest.raises(StudyError, match=r"groups\.2: no stimulus belongs to this group"):
        read(text)


def test_blocks_by_a_column_that_is_not_there():
    text = GOOD.replace("within: group", "within: block, blocks: {by: colour}")
    with pytest.raises(StudyError, match=r"order\.blocks\.by: found 'colour'"):
        read(text)


def test_a_list_is_no_study():
    with pytest.raises(StudyError, match="keys and values are expected"):
        read("- a\n- b\n")


def test_the_keys_that_belong_to_some_tasks_are_listed():
    assert {*TASK_KEYS} == {key for task in TASKS.values() for key in task.keys}


THRESHOLD = (SHIPPED / "vibration_threshold" / "study.yaml").read_text("utf-8")
NESTED = [
    ("design: forced_choice", "design: oddityy", "intervals.design: found 'oddityy', expected 'forced_choice', "),
    ("seconds: 0.6", "secods: 0.6", "intervals.secods: unknown key; did you mean 'seconds'?"),
    ("easy: {every: 12}", "easy: {evry: 12}", "intervals.catch.easy.evry: unknown key; did you mean 'every'?"),
    ("gap_s: 0.5", "count: 1", "intervals.count: at least 2 for design: forced_choice, found 1"),
    ("points: 3", "points: 99", "ask[1].points: found 99, input should be less than or equal to 11"),
    ("points: 3", "pints: 3", "ask[1].pints: unknown key; did you mean 'points'?"),
    ("kind: confidence", "kind: confidnce", "ask[1].kind: found 'confidnce', expected choice, scale, number, text, "),
    ("name: sure", "name: chosen", "ask[1].name: the question 'chosen' appears twice"),
    ("kind: questplus", "kind: questplu", "procedure.kind: found 'questplu', expected constant, limits, staircase, "),
    ("points: 51}\n  model", "points: 1}\n  model", "procedure.level.points: found 1, input should be greater than"),
    ("points: 51}\n  model", "ponts: 51}\n  model", "procedure.level.ponts: unknown key; did you mean 'points'?"),
    ("slope: {from: 0.5", "slope: {from: -1", "procedure.model.slope: values above 0 are expected"),
    ("guess: 0.5\n    lapse", "guess: [0.5, x]\n    lapse", "procedure.model.guess[1]: found 'x', input should be"),
    ("threshold_sd: 1.2", "threshold_s: 1.2", "procedure.stop.threshold_s: unknown key; did you mean 'threshold_sd'?"),
    ("threshold_sd: 1.2, at_least: 32", "series: 3", "procedure.stop.series: series is not a rule of kind: questplus"),
]


@pytest.mark.parametrize(("old", "new", "message"), NESTED)
def test_a_complaint_about_a_part_that_is_loaded_late_names_its_own_line_and_path(old, new, message):
    text = THRESHOLD.replace(old, new, 1)
    line = 1 + next(n for n, (a, b) in enumerate(zip(text.splitlines(), THRESHOLD.splitlines(), strict=True)) if a != b)
    with pytest.raises(StudyError) as caught:
        read(text)
    [complaint] = str(caught.value).splitlines()
    assert complaint.startswith(f"study.yaml: line {line}: {message}")


def test_a_complaint_about_one_of_several_procedures_names_its_place():
    start, end = THRESHOLD.index("procedure:\n") + len("procedure:\n"), THRESHOLD.index("practice:")
    indented = THRESHOLD[start:end].replace("\n  ", "\n    ")
    head, _, tail = "".join(f"  - name: {name}\n  {indented}" for name in "ab").rpartition("at_least")
    text = f"{THRESHOLD[:start]}{head}at_most{tail}{THRESHOLD[end:]}"
    line = text[: start + len(head)].count("\n") + 1
    with pytest.raises(StudyError, match=rf"^study.yaml: line {line}: procedure\[1\].stop.at_most: unknown key; "):
        read(text)
