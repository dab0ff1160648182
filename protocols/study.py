"""The schema of study.yaml, frozen and strict."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from math import floor, log10
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    AliasChoices,
    BeforeValidator,
    Field,
    PlainValidator,
    SerializeAsAny,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticKnownError

from palpate.protocols.extensions import is_own
from palpate.protocols.known_tasks import TASKS
from palpate.protocols.needs import NEEDS, needs_with
from palpate.protocols.orders import Design
from palpate.protocols.registry import load_object
from palpate.protocols.strict import Strict

LARGEST_STUDY = 5000
MOST_ADJECTIVES = 80
MOST_LABELS, MOST_STEPS = 21, 100
MOST_ANCHORS = 20
ROUNDING = 1e-6
"""Greatest deviation, in steps, of a decimal from a step of its scale: doubles do not represent tenths exactly."""


def _plain_name(value: str) -> str:
    if not value.replace("_", "").replace("-", "").isalnum() or not value.isascii():
        raise ValueError("a name of letters, digits, _ and - is expected")
    return value


def _one_of(names: Collection[str], own_later: bool = False) -> BeforeValidator:
    """Return a validator that refuses unknown names with the error that pydantic gives for a literal.

    `own_later`: names of extensions pass. They are looked up when a study's file is read; a replay does without them.
    """

    def known(value: Any) -> Any:
        if own_later and is_own(value):
            return value
        if not isinstance(value, str) or value not in names:
            *first, last = map(repr, names)
            raise PydanticKnownError("literal_error", {"expected": f"{', '.join(first)} or {last}"})
        return value

    return BeforeValidator(known)


def _loaded(place: str) -> PlainValidator:
    """Return a validator of a key whose schema, the function at "module:NAME", is imported when a file has the key."""

    def validate(value: Any) -> Any:
        return load_object(place)(value)

    return PlainValidator(validate)


Text = Annotated[str, Field(strict=True, min_length=1, max_length=10_000)]
Name = Annotated[str, Field(strict=True, min_length=1, max_length=64), AfterValidator(_plain_name)]
Level = Annotated[Text, BeforeValidator(lambda value: str(value) if type(value) is int else value)]
"""A level of a factor, which may be written as a whole number and becomes a text."""
Whole = Annotated[int, Field(strict=True)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)] | Whole
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0.1, le=600, allow_inf_nan=False)]
Spread = Annotated[float, Field(ge=0, allow_inf_nan=False)]
RecordingSeconds = Annotated[float, Field(ge=0.1, le=3600, allow_inf_nan=False)]
Minutes = Annotated[float, Field(gt=0, le=24 * 60, allow_inf_nan=False)]
People = Annotated[int, Field(strict=True, ge=1, le=100_000)]
Days = Annotated[int, Field(strict=True, ge=0, le=3650)]
OverSessions = Literal["same", "next_row", "mirrored"]
TaskName = Annotated[str, _one_of(TASKS)]
NeedName = Annotated[str, _one_of(NEEDS, own_later=True)]


def is_number(text: str) -> bool:
    """Return whether the text is a finite number."""
    try:
        value = float(text)
    except ValueError:
        return False
    return value - value == 0


def _digits(size: float) -> int:
    """Return the decimals that distinguish a ten-thousandth of `size`; four from 1 upwards."""
    return 4 - min(0, floor(log10(size)))


class Attribute(Strict):
    """A bipolar adjective pair, written as [low, high] or with its category, its explanation and its own name."""

    low: Text
    high: Text
    outcome: Text | None = Field(default=None, validation_alias=AliasChoices("name", "outcome"))
    category: Text | None = None
    explanation: Text | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_pair(cls, value: Any) -> Any:
        if isinstance(value, list | tuple):
            if len(value) != 2:
                raise ValueError(f"a pair of two adjectives is expected, found {len(value)}")
            return {"low": value[0], "high": value[1]}
        return value

    @property
    def name(self) -> str:
        """Return the name of the answers: the one that the study gives, else the low pole."""
        return self.outcome or self.low


def _pairs_of_labels(value: Any) -> Any:
    """Return the labels as pairs; they are written {VALUE: TEXT}, with keys that are texts by now."""
    if not isinstance(value, dict):
        return value
    if bad := [key for key in value if not is_number(str(key))]:
        raise ValueError(f"labels: {bad[0]!r} is not a value of the scale")
    return [(float(key), text) for key, text in value.items()]


class Scale(Strict):
    """A rating scale; without a step it is continuous. The marker starts unset: untouched is not zero.

    Its line is 127 mm long on every screen unless the study says otherwise (thesis 3.3.3). `labels` are words below the
    line, by their values. `ticks` mark the labels or the steps; without ticks no place on the line attracts answers.
    """

    low: Number = Field(validation_alias=AliasChoices("from", "low"))
    high: Number = Field(validation_alias=AliasChoices("to", "high"))
    step: Number | None = None
    start: Literal["unset"] = "unset"
    length_mm: Annotated[float, Field(ge=40, le=500, allow_inf_nan=False)] = 127.0
    labels: Annotated[
        tuple[tuple[Number, Text], ...], BeforeValidator(_pairs_of_labels), Field(max_length=MOST_LABELS)
    ] = ()
    ticks: Literal["none", "labels", "steps"] = "none"

    @property
    def labelled(self) -> tuple[tuple[float, str], ...]:
        """Return the labels with their values, from the low end to the high end."""
        return tuple(sorted((float(value), text) for value, text in self.labels))

    @property
    def ticked(self) -> tuple[float, ...]:
        """Return the values that are marked by ticks, from the low end to the high end."""
        if self.ticks == "steps" and self.step is not None:
            steps = round((self.high - self.low) / self.step)
            return tuple(float(self.nearest(self.low + n * self.step)) for n in range(steps + 1))
        return tuple(value for value, _ in self.labelled) if self.ticks == "labels" else ()

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"from ({self.low}) must be below to ({self.high})")
        if self.step is not None:
            steps = (self.high - self.low) / self.step if self.step > 0 else 0
            if round(steps) < 1 or abs(steps - round(steps)) > ROUNDING:
                raise ValueError(f"step ({self.step}) must divide the range {self.low} to {self.high}")
        return self

    @model_validator(mode="after")
    def _on_the_line(self) -> Self:
        for value, text in self.labels:
            if not self.holds(value):
                raise ValueError(f"labels: {text!r} stands at {value:g}, which is not a value of the scale")
        if len({value for value, _ in self.labels}) < len(self.labels):
            raise ValueError("labels: two labels stand at one value")
        if self.ticks == "labels" and not self.labels:
            raise ValueError("ticks: labels needs labels: {VALUE: TEXT, ...}")
        if self.ticks == "steps" and (self.step is None or (self.high - self.low) / self.step > MOST_STEPS):
            raise ValueError(f"ticks: steps needs a step, of at most {MOST_STEPS} on the line")
        return self

    def nearest(self, value: float) -> float:
        """Return the scale's answer closest to `value`: clipped, and rounded to a step if it has steps, else to four
        digits.
        """
        inside = min(max(value, self.low), self.high)
        if self.step is None:
            return self._clipped(round(float(inside), _digits(self.high - self.low)))
        stepped = self.low + round((inside - self.low) / self.step) * self.step
        return self._clipped(round(stepped, _digits(self.step) + 5))

    def _clipped(self, value: float) -> float:
        return min(max(value, self.low), self.high)

    def holds(self, value: object) -> bool:
        """Return whether `value` is an answer that the scale allows."""
        if type(value) not in (int, float):
            return False
        number = float(value)  # type: ignore[arg-type]
        if not self.low <= number <= self.high:
            return False
        return self.step is None or abs(self.nearest(number) - number) <= ROUNDING * abs(self.step)


class Blocks(Strict):
    """The column that divides the stimuli into blocks, and the design that orders the blocks.

    `instructions` are texts that are shown before a block, by its level in the column: a glove, a finger, a noise.
    """

    by: Text
    design: Design = "latin"
    instructions: dict[Level, Text] = Field(default={})


class Order(Strict):
    """The design that orders the stimuli, within a participant's group or within each block."""

    design: Design
    within: Literal["group", "block"] = "group"
    blocks: Blocks | None = None
    repeats: Annotated[Whole, Field(ge=1, le=100)] = 1
    seed: Whole = 0
    over_sessions: OverSessions | None = None

    @model_validator(mode="after")
    def _blocks_when_needed(self) -> Self:
        if (self.within == "block") != (self.blocks is not None):
            raise ValueError("within: block and blocks: {by: COLUMN} go together")
        return self


class PracticeGoal(Strict):
    """Practice ends when `correct` of the last `of` answers were right."""

    correct: Annotated[Whole, Field(ge=1, le=100)]
    of: Annotated[Whole, Field(ge=1, le=100)]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.correct > self.of:
            raise ValueError(f"correct ({self.correct}) must not be above of ({self.of})")
        return self


class Practice(Strict):
    """Stimuli of the practice trials, by id, in the order listed; their answers are stored but do not count.

    In tasks with right answers practice may go on `until` a goal is met, through the stimuli again and again, for
    `at_most` trials.
    """

    stimuli: Annotated[tuple[Level, ...], Field(min_length=1)]
    until: PracticeGoal | None = None
    at_most: Annotated[Whole, Field(ge=1, le=200)] | None = None

    @model_validator(mode="after")
    def _both_or_neither(self) -> Self:
        if (self.until is None) != (self.at_most is None):
            raise ValueError("until: {correct: N, of: N} and at_most: N go together")
        if self.until is not None and self.at_most is not None and self.until.of > self.at_most:
            raise ValueError(f"until: of ({self.until.of}) must not be above at_most ({self.at_most})")
        return self


class Feedback(Strict):
    """Whether an answer was right, shown for some seconds after each trial, or after practice trials only."""

    after: Literal["all", "practice"] = "all"
    seconds: Annotated[float, Field(ge=0.1, le=10, allow_inf_nan=False)] = 0.8


class Resume(Strict):
    """What an interrupted session needs before it goes on: not too long a break, and what is repeated.

    `within_h`: after more hours it is refused, unless the experimenter accepts that on record. `repeat`: the
    instructions are shown again; the block under way begins again, and its answers no longer count.
    """

    within_h: Annotated[float, Field(gt=0, le=24 * 365, allow_inf_nan=False)] | None = None
    repeat: tuple[Literal["instructions", "block"], ...] = ()


class OnsetBound(Strict):
    """The longest time from command to onset of a stimulus, in ms, that the rig's certificate may show."""

    p50: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)] | None = None
    p99: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)] | None = None
    max: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)] | None = None

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.p50 is None and self.p99 is None and self.max is None:
            raise ValueError("p50, p99 or max is expected, in ms")
        return self


class Anchor(Strict):
    """A reference stimulus, by its id, with the text shown while it is felt (thesis 5.8.3).

    `attribute` and `value` say the same as data: where it is on that attribute's scale, or its answer to a question.
    Where doors are made from wishes, `wish` is the setting that this one is made from; attributes without a value are
    at the middle of the scale.
    """

    id: Level
    label: Text
    attribute: Text | None = None
    value: Number | None = None
    wish: Annotated[dict[Text, Number], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _both_or_neither(self) -> Self:
        if (self.attribute is None) != (self.value is None):
            raise ValueError("attribute: NAME and value: NUMBER go together")
        return self


class Anchors(Strict):
    """Reference stimuli that are felt before each block or trial, or once before the first; they are not trials.

    `rated: false` takes them out of the trials, so that they are felt as references only.
    """

    stimuli: Annotated[tuple[Anchor, ...], Field(min_length=1, max_length=MOST_ANCHORS)]
    before: Literal["trial", "block", "session"] = "block"
    rated: bool = True


class Participants(Strict):
    """The sample: how many people are planned, how many sessions each has, and how many days lie between sessions.

    `planned` counts all people, `per_group` those of each group. Without `sessions` the study has one. `apart_days` are
    the least and the greatest number of calendar days from one session to the next.
    """

    planned: People | None = None
    per_group: People | None = None
    sessions: Annotated[Whole, Field(ge=1, le=100)] | None = None
    apart_days: tuple[Days, Days] | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.apart_days is not None and self.apart_days[0] > self.apart_days[1]:
            raise ValueError(f"apart_days: the fewest days come first, found {list(self.apart_days)}")
        if self.apart_days is not None and (self.sessions or 1) < 2:
            raise ValueError("apart_days needs sessions: 2 or more")
        return self


class Rest(Strict):
    """The rests of a session: after how many counted trials, and whether every trial's form has a button to rest."""

    every: Annotated[Whole, Field(ge=1)] | None = None
    button: bool = False

    @model_validator(mode="after")
    def _at_some_time(self) -> Self:
        if self.every is None and not self.button:
            raise ValueError("every: N, or button: true, or both are expected")
        return self


class Word(Strict):
    """An adjective of a list, and its source."""

    word: Text
    source: Text | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        return {"word": value} if isinstance(value, str) else value


class Adjectives(Strict):
    """The list of words that a participant can tick, in the listed order or shuffled for each participant."""

    words: Annotated[tuple[Word, ...], Field(min_length=1, max_length=MOST_ADJECTIVES)]
    order: Literal["as_listed", "random"] = "as_listed"
    further: bool = False


class Lexicon(Strict):
    """The least number of words that participants write themselves."""

    at_least: Annotated[Whole, Field(ge=0, le=20)] = 1


class Capture(Strict):
    """A recording of each stimulus: which device, and for how many seconds or by which column of the stimulus table."""

    device: Annotated[str, _one_of(needs_with("records"), own_later=True)]
    seconds: RecordingSeconds | Text


class Live(Strict):
    """The live mode of task authoring: the door follows the sliders while it is felt.

    `show_force` draws its force beside the sliders.
    """

    show_force: bool = True


class Noise(Strict):
    """The masking noise of a study: its level at the ear must be known and at most this, in dB(A)."""

    at_most_db_a: Annotated[float, Field(ge=20, le=80, allow_inf_nan=False)]


class Item(Strict):
    """A statement of a questionnaire, or a question of an interview."""

    name: Name
    text: Text


class Questionnaire(Strict):
    """The statements of a questionnaire, rated from 1 to `points`, with labels for the ends."""

    items: Annotated[tuple[Item, ...], Field(min_length=1, max_length=20)]
    ends: tuple[Text, Text] = ("Strongly disagree", "Strongly agree")
    points: Annotated[Whole, Field(ge=2, le=11)] = 7


class Criterion(Strict):
    """A yes/no question before everything else, and the answer of people who can take part."""

    name: Name
    text: Text
    answer: Literal["yes", "no"]


class Observer(Strict):
    """The psychometric function of simulated people in tasks with choices: share of hits by level.

    `threshold` is one number or one for each track, by its name; `slope`, `guess`, `lapse`, `shape` and `scale` as in
    `procedure: {model: ...}`. `threshold_sd` varies between people. `yes` is the share of "yes" without a stimulus.
    """

    threshold: Number | dict[Text, Number]
    slope: Annotated[Number, Field(gt=0)] = 3.0
    guess: Share = 0.5
    lapse: Share = 0.02
    shape: Literal["weibull", "logistic", "gaussian"] = "weibull"
    scale: Literal["linear", "log10", "db"] = "linear"
    threshold_sd: Spread = 0.0
    yes: Share = 0.1

    def threshold_of(self, track: str, stimulus: str) -> float:
        """Return the mean threshold for a track, by its name or that of its stimulus; 0 if neither is known."""
        if not isinstance(self.threshold, dict):
            return float(self.threshold)
        return float(self.threshold.get(track, self.threshold.get(stimulus, 0.0)))


class Simulation(Strict):
    """The perception of simulated participants.

    latents[attribute][column] is the weight, in scale units, of the column's z-score over the study's stimuli; the
    column `intercept` is a constant. Words and questionnaire items have latents too, in logits and in points;
    `vocabulary` holds the words that come to mind. gain_sd and bias_sd (scale units) vary between participants and
    attributes, noise_sd (scale units) between answers; a lapse is an answer anywhere on the scale. `anchored` is the
    share of a person's own gain and bias that an anchor removes, for the attributes that have one. `kind` is another
    kind of simulated participants than the shipped one.
    """

    kind: Text | None = None
    latents: dict[Text, dict[Text, Number]] = Field(default={})
    observer: Observer | None = None
    gain_sd: Spread = 0.15
    bias_sd: Spread = 1.0
    noise_sd: Spread = 1.5
    lapse_rate: Share = 0.0
    revise_rate: Share = 0.0
    anchored: Share = 0.0
    answer_s: Seconds = 2.0
    present_s: Seconds = 2.5
    vocabulary: tuple[Text, ...] = ()


class Analysis(Strict):
    """The tests of the report: factors crossed within a group, the factor that all participants share, its families."""

    within: tuple[Text, ...] = ()
    pooled: Text | None = None
    families: Text | None = None


class Stimulus(Strict):
    """A row of the stimulus table: its columns as written, and the SHA-256 of its file if it has one."""

    id: Level
    columns: dict[Text, Annotated[str, Field(strict=True)]] = Field(default={})
    sha256: Text | None = None


NOT_MET = ("participants", "minutes", "questions")
"""Keys of a study that change nothing in the trials: they are recorded, but studies that differ only in them count as
the same. The questions about a participant are in the lab's forms.
"""


def conditions_of(definition: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of a study's definition that participants encounter: all but sample, minutes and questions.

    A rule for orders over sessions is compared by its effect: the default counts as the rule that it stands for.
    """
    order = dict(definition["order"])
    sessions = (definition.get("participants") or {}).get("sessions") or 1
    rule = order.pop("over_sessions", None) or rule_for(sessions)
    if rule != "same":
        order["over_sessions"] = rule
    return {**{key: value for key, value in definition.items() if key not in NOT_MET}, "order": order}


def rule_for(sessions: int) -> OverSessions:
    """Return the rule that orders sessions if the study gives none: the next row if it declares several sessions."""
    return "next_row" if sessions > 1 else "same"


class Console(Strict):
    """The columns of the stimulus table that the experimenter's console hides, and with them the stimulus' id."""

    blind: Annotated[tuple[Text, ...], Field(min_length=1)]


class Study(Strict):
    """A study with its stimuli: everything that plans are compiled from."""

    study: Name
    title: Text | None = None
    task: TaskName
    participants: Participants | None = None
    minutes: Minutes | None = None
    opening: tuple[Literal["consent", "eligibility", "demographics"], ...] = ()
    eligible: Annotated[tuple[Criterion, ...], Field(max_length=20)] = ()
    questions: tuple[Name, ...] | None = None
    setup: Annotated[tuple[Text, ...], Field(max_length=20)] = ()
    instructions: Text | None = None
    stimuli: Annotated[tuple[Stimulus, ...], Field(min_length=1, max_length=LARGEST_STUDY)]
    groups: dict[Level, dict[Text, tuple[Level, ...]]] = Field(default={})
    attributes: Annotated[tuple[Attribute, ...], Field(max_length=80)] = ()
    scale: Scale | None = None
    sides: Annotated[tuple[Name, ...], Field(max_length=4)] = ()
    ask: Annotated[Any, _loaded("palpate.protocols.fields:questions_from")] = ()
    intervals: Annotated[Any, _loaded("palpate.protocols.intervals:intervals_from")] = None
    procedure: Annotated[Any, _loaded("palpate.protocols.procedures:procedures_from")] = ()
    pairs: Annotated[Any, _loaded("palpate.protocols.pairs:pairs_from")] = None
    feedback: Feedback | None = None
    adjectives: Adjectives | None = None
    lexicon: Lexicon | None = None
    capture: Capture | None = None
    live: Live | None = None
    settings: SerializeAsAny[Strict] | None = None
    closing: tuple[Literal["suggestions", "questionnaire", "interview"], ...] = ()
    interview: Annotated[tuple[Item, ...], Field(max_length=10)] = ()
    questionnaire: Questionnaire | None = None
    order: Order
    practice: Practice | None = None
    anchors: Anchors | None = None
    rest: Rest | None = None
    resume: Resume | None = None
    navigation: Literal["forward", "back_and_forward"] = "forward"
    needs: tuple[NeedName, ...] = ()
    noise: Noise | None = None
    onset_ms: OnsetBound | None = None
    console: Console | None = None
    analysis: Analysis | None = None
    simulation: Simulation | None = None

    @field_validator("settings", mode="plain")
    @classmethod
    def _of_the_task(cls, value: Any, info: ValidationInfo) -> Strict | None:
        """Read the settings by the schema of the task; with an unknown task, report only that."""
        if value is None or "task" not in info.data:
            return None
        task = info.data["task"]
        schema: type[Strict] | None = TASKS[task].settings
        if schema is None:
            raise ValueError(f"task {task} has no settings; leave this key out")
        return schema.model_validate(value)

    def definition(self) -> dict[str, Any]:
        """Return the study as JSON data with only the keys that its author set, so that new defaults change no
        digest.
        """
        return self.model_dump(mode="json", exclude_unset=True)

    def conditions(self) -> dict[str, Any]:
        """Return what participants encounter, as JSON data by which plans, sessions and analyses are compared."""
        return conditions_of(self.definition())

    @property
    def sessions(self) -> int:
        """Return the number of sessions of each participant; 1 if the study declares none."""
        return (self.participants and self.participants.sessions) or 1

    @property
    def declares_sessions(self) -> bool:
        """Return whether the study says how many sessions each participant has."""
        return self.participants is not None and self.participants.sessions is not None

    @property
    def over_sessions(self) -> OverSessions:
        """Return the rule that orders later sessions."""
        return self.order.over_sessions or rule_for(self.sessions)

    def is_mirrored(self, session: int) -> bool:
        """Return whether the session of this number reverses the first one's order."""
        return self.over_sessions == "mirrored" and session % 2 == 0

    @property
    def blind(self) -> tuple[str, ...]:
        """Return the columns of the stimulus table that the experimenter must not see."""
        return () if self.console is None else self.console.blind

    def stimuli_of(self, group: str | None) -> tuple[Stimulus, ...]:
        """Return the stimuli of a group's trials, in the order of the table; all stimuli if there are no groups.

        Anchors that are not rated are left out.
        """
        apart = {anchor.id for anchor in self.anchors.stimuli} if self.anchors and not self.anchors.rated else set()
        levels = {} if group is None else self.groups[group]
        trials = (stimulus for stimulus in self.stimuli if stimulus.id not in apart)
        return tuple(s for s in trials if all(s.columns[column] in wanted for column, wanted in levels.items()))

    def by_block(self, stimuli: Iterable[Stimulus]) -> dict[str, list[Stimulus]]:
        """Return these stimuli by their block, in their order; a study without blocks has one, main."""
        blocks: dict[str, list[Stimulus]] = {}
        for stimulus in stimuli:
            blocks.setdefault(self.block_of(stimulus), []).append(stimulus)
        return blocks

    def block_of(self, stimulus: Stimulus) -> str:
        """Return the block of a stimulus; main if the study has no blocks."""
        return "main" if self.order.blocks is None else stimulus.columns[self.order.blocks.by]
