"""The columns of the tables that tests ask about: of a study's future answers, or of a table that exists already."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import pandas as pd

from palpate.analysis.plans.where import Condition, Range, first_word, level_texts, levels_of
from palpate.analysis.ratings.collected_choices import TABLE as CHOICES
from palpate.analysis.ratings.collected_choices import study_tracks
from palpate.analysis.ratings.own_answers import tables_of_study
from palpate.analysis.ratings.people import ANSWER, CLOSED
from palpate.analysis.ratings.reading import column_name
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import Question
from palpate.protocols.pairs import PAIRS
from palpate.protocols.study import Stimulus, Study, is_number
from palpate.protocols.tasks import gives_ratings


@dataclass(frozen=True)
class Column:
    """What is known of a column before there are answers: its `levels` (none: any), and whether it holds `numbers`.

    `plain` columns hold their values as numbers, others as text: columns of the stimuli, and the session, which becomes
    a number where a test names it as a factor. `about_people`: it is an answer of participants about themselves, which
    stands in a table of its own.
    """

    levels: tuple[str, ...] = ()
    numbers: bool = False
    plain: bool = False
    about_people: bool = False

    def problem(self, name: str, condition: Condition) -> str:
        """Return why no row can satisfy the condition, else an empty text."""
        if isinstance(condition, Range):
            if not self.numbers:
                word = first_word(self.levels)
                what = "words" if word is None else f"words, as {word!r}"
                return f"{name!r} holds {what}; a range ({condition}) asks about numbers"
            if self.levels and not any(map(condition.holds, self.levels)):
                return f"no {name} {condition}; there are {', '.join(sorted(self.levels))}"
        for level in levels_of(condition):
            if self.levels and level not in self.levels:
                return f"no {name} {level!r}; {nearest(level, sorted(self.levels))}"
            if self.numbers and not is_number(level):
                return f"{name!r} holds numbers, and {level!r} is none"
        return ""


Columns = Mapping[str, Column]
WORDS, NUMBERS = Column(), Column(numbers=True, plain=True)
TRIALS = "trials"
"""The name of the table of trials, which exclusions look at, beside those that tests take."""
OF_KINDS = {"text": WORDS, "number": NUMBERS, "whole": NUMBERS, "truth": NUMBERS}
"""What a column of a form's own table holds, by its kind."""


def of_levels(texts: Iterable[str]) -> Column:
    """Return a column of these levels."""
    known = tuple(dict.fromkeys(texts))
    return Column(known, bool(known) and all(map(is_number, known)))


def about_people(study: Study, questions: Sequence[Question]) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Return the questions about participants by column: the kind of the answer, and its levels (none: any).

    A question or item NAME is also the column `answer.NAME`, and only that where the stimuli have a column NAME.
    """
    asked: dict[str, tuple[str, tuple[str, ...]]] = {
        question.name: (question.kind, tuple(value for value, _ in question.levels))
        for question in questions
        if question.kind in CLOSED
    }
    if study.questionnaire is not None:
        points = tuple(str(n) for n in range(1, study.questionnaire.points + 1))
        asked |= {item.name: ("points", points) for item in study.questionnaire.items}
    taken = {column_name(name) for stimulus in study.stimuli[:1] for name in stimulus.columns}
    return {name: answer for name, answer in asked.items() if name not in taken} | {
        f"{ANSWER}{name}": answer for name, answer in asked.items()
    }


def trial_row(study: Study, group: str | None, stimulus: Stimulus, session: int) -> dict[str, str]:
    """Return what is known before a trial of its row in the study's tables, by column, as text."""
    own = {column_name(name): level for name, level in stimulus.columns.items()}
    block = study.block_of(stimulus)
    return {**own, "stimulus": stimulus.id, "group": group or "", "session": str(session), "block": block}


def study_tables(study: Study, questions: Sequence[Question]) -> dict[str, Columns]:
    """Return the columns of a study's future tables: ratings, words, forms, forms' own, as far as it has them, trials.

    `questions` are those about a person, which are columns of every table.
    """
    people = {
        name: Column(points, kind != "choice", about_people=True)
        for name, (kind, points) in about_people(study, questions).items()
    }
    sessions, groups = range(1, study.sessions + 1), study.groups or (None,)
    rows = [trial_row(study, *place) for place in product(groups, study.stimuli, sessions)]
    known = {name: of_levels(row[name] for row in rows) for name in rows[0]}
    session = known["session"] if study.declares_sessions else Column(numbers=True)
    whose = {"participant": WORDS, "session": session, "group": known["group"]}
    trials = {**whose, "trial": NUMBERS, **known, "session": session}
    trials["stimulus"] = Column(known["stimulus"].levels)
    tables: dict[str, Columns] = {TRIALS: trials}
    if study.adjectives is not None or study.lexicon is not None or "suggestions" in study.closing:
        tables["words"] = {**trials, "trial": Column(numbers=True), "kind": WORDS, "word": WORDS}
    if gives_ratings(study):
        tables["ratings"] = {
            **trials,
            "study": of_levels([study.study]),
            "attribute": Column(tuple(attribute.name for attribute in study.attributes)),
            **{"value": NUMBERS, "response_time_s": NUMBERS, "revised": Column(("False", "True"))},
        }
    if study.questionnaire is not None:
        items = Column(tuple(item.name for item in study.questionnaire.items))
        tables["forms"] = {**whose, "form": WORDS, "attribute": items, "value": NUMBERS, "text": WORDS}
    for own in tables_of_study(study):
        tables[own.name] = {
            **trials,
            **{column.name: OF_KINDS[column.kind] for column in own.columns},
            "stimulus": trials["stimulus"],
            "session_number": session if study.declares_sessions else NUMBERS,
            "attempt": NUMBERS,
            "seq": NUMBERS,
        }
    if CHOICES in tables:
        tables[CHOICES] = {
            **tables[CHOICES],
            "track": Column(tuple(study_tracks(study))) if study.procedure else trials["block"],
            "other": WORDS if study.procedure else trials["stimulus"],
            "procedure": of_levels([procedure.kind for procedure in study.procedure] or [PAIRS]),
            "design": of_levels([study.intervals.design]),
        }
    return {name: {**people, **columns} for name, columns in tables.items()}


def table_columns(table: pd.DataFrame) -> Columns:
    """Return the columns of a table that exists, with their levels."""
    columns = {str(name): of_levels(sorted(level_texts(table[name].dropna()).unique())) for name in table.columns}
    return {name: replace(column, plain=column.numbers) for name, column in columns.items()}
