"""What stands on a report's page, as plain data: texts and tables, nothing of HTML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from analysis.reporting.analysed import Analysed, software
from analysis.reporting.page_methods import methods
from analysis.reporting.page_table import Column, Table, number, table, words
from analysis.reporting.page_tests import Comparison, VarianceTable, comparisons, refusals, variance_tables
from analysis.reporting.page_text import count, fixed, phrase
from analysis.reporting.pictures import shown_factors
from analysis.reporting.sentences import headlines


@dataclass(frozen=True)
class Page:
    """A report without its figures."""

    title: str
    lead: str
    simulated: bool
    facts: tuple[tuple[str, str], ...]
    results_intro: str
    headlines: tuple[tuple[str, str], ...]
    not_tested: tuple[str, ...]
    complete: bool
    findings: tuple[str, ...]
    exclusions: Table
    participants: Table
    analyses: tuple[VarianceTable, ...]
    comparisons_intro: str
    comparisons: tuple[Comparison, ...]
    methods: tuple[str, ...]
    inputs: Table
    software: Table


def page_of(found: Analysed) -> Page:
    """The page of an analysed data set: equal analyses give equal pages."""
    return Page(
        title=found.title,
        lead=_lead(found),
        simulated=found.ratings.simulated,
        facts=tuple(_facts(found)),
        results_intro=_results_intro(found),
        headlines=tuple(headlines(found)),
        not_tested=tuple(refusals(found)),
        complete=found.design.ok,
        findings=tuple(each.text() for each in (*found.design.problems, *found.design.notes)),
        exclusions=_exclusions(found),
        participants=_participants(found),
        analyses=tuple(variance_tables(found)),
        comparisons_intro=_comparisons_intro(found),
        comparisons=tuple(comparisons(found)),
        methods=tuple(methods(found)),
        inputs=_inputs(found),
        software=table(("package", "version"), software().items()),
    )


def level_table(found: Analysed) -> Table:
    """The numbers that both figures show."""
    factors = shown_factors(found.ratings)
    rows = [
        (
            str(row["attribute"]),
            *(str(row[factor]) for factor in factors),
            fixed(row["mean"]),
            fixed(row["sd"]),
            str(row["n"]),
        )
        for row in found.levels.to_dict("records")
    ]
    return table(("attribute", *factors, number("mean"), number("SD"), number("participants")), rows)


def _lead(found: Analysed) -> str:
    ratings = found.ratings
    people = count(len(ratings.participants), "participant")
    given = count(len(ratings.table), "rating")
    if len(ratings.attributes) == 1:
        return f"{people}, {given}."
    return f"{people}, {given} on {len(ratings.attributes)} attributes."


def _facts(found: Analysed) -> Iterator[tuple[str, str]]:
    ratings = found.ratings
    yield "Study" if "session" in ratings.table.columns else "Data set", ratings.name
    yield "Participants", _by_group(found)
    yield "Ratings", f"{len(ratings.table):,}"
    yield "Within participants", ", ".join(f"{name} ({_levels_met(found, name)})" for name in ratings.within)
    if ratings.scale is not None:
        low, high = (f"{end:g}".replace("-", "−") for end in (ratings.scale.low, ratings.scale.high))
        step = f", steps of {ratings.scale.step:g}" if ratings.scale.step else ""
        yield "Scale", f"{low} to {high}{step}"
    left_out = sum(each.rows for each in ratings.exclusions)
    yield "Left out", count(left_out, "rating") if ratings.exclusions else "nothing"
    if ratings.source:
        yield "Source", ratings.source
    if ratings.licence:
        yield "Licence", ratings.licence


def _levels_met(found: Analysed, factor: str) -> str:
    """How many levels there are, and how many of them a participant met where these are fewer."""
    total = len(found.ratings.levels(factor))
    met = found.ratings.table.groupby("participant")[factor].nunique()
    most = int(met.max()) if len(met) else 0
    return f"{total}" if most == total else f"{total}, of which each met {most}"


def _by_group(found: Analysed) -> str:
    ratings = found.ratings
    total = str(len(ratings.participants))
    if len(ratings.between) != 1:
        return total
    groups = ratings.table.groupby(ratings.between[0])["participant"].nunique()
    sizes = ", ".join(f"{ratings.between[0]} {group}: {groups[group]}" for group in ratings.levels(ratings.between[0]))
    return f"{total} ({sizes})"


def _results_intro(found: Analysed) -> str:
    first = next((found.headline(attribute) for attribute in found.ratings.attributes), None)
    if first is None:
        return "No test was asked for."
    over = phrase(first.question.averaged_over)
    means = f" Each participant's ratings were averaged over {over} first." if over else ""
    return f"The effect of {phrase(first.question.factors)} on each attribute, {first.question.scope}.{means}"


def _comparisons_intro(found: Analysed) -> str:
    asked = [question for question in found.statistics.questions if question.kind == "pairs"]
    factors = phrase([question.factors[0] for question in asked])
    return f"Levels of {factors}, compared within participants, each participant's ratings of a level averaged first."


def _exclusions(found: Analysed) -> Table:
    rows = [(each.what, each.who, each.why, f"{each.rows:,}") for each in found.ratings.exclusions]
    return table(("what", words("who"), words("why"), number("ratings")), rows)


def _participants(found: Analysed) -> Table:
    ratings = found.ratings
    has = [name for name in ("session", "revised", "response_time_s") if name in ratings.table.columns]
    heads = {"session": words("session"), "revised": number("revised"), "response_time_s": number("median response, s")}
    rows = []
    people = dict(iter(ratings.table.groupby("participant", sort=False)))
    for name in ratings.participants:
        own = people[name]
        cells = {
            "session": lambda own=own: ", ".join(dict.fromkeys(own["session"])),
            "revised": lambda own=own: f"{int(own['revised'].sum()):,}",
            "response_time_s": lambda own=own: fixed(own["response_time_s"].median(), 1),
        }
        groups = [", ".join(dict.fromkeys(own[factor])) for factor in ratings.between]
        rows.append((name, *groups, f"{len(own):,}", *(cells[column]() for column in has)))
    return table(("participant", *ratings.between, number("ratings"), *(heads[name] for name in has)), rows)


def _inputs(found: Analysed) -> Table:
    rows = [(each.name, each.note, each.sha256) for each in found.ratings.inputs]
    return table((words("input"), words("what"), Column("SHA-256", "hash")), rows)
