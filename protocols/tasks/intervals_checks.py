"""What must be true of a study with intervals: its levels, pairs, questions, names and devices fit together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from palpate.protocols.complaints import Problem
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.intervals import Intervals
from palpate.protocols.needs import NEEDS
from palpate.protocols.pairs import MOST_PAIRS, rounds_of_all
from palpate.protocols.study import Study, is_number
from palpate.protocols.tracks import PRACTICE, procedure_path, tracks_in
from palpate.protocols.yaml_text import Path

ROUNDED = 0.01
"""A guess rate differs from chance by more: 0.33 means a third."""
COMPARED = ("same_different", "oddity")
"""Designs whose other intervals cannot be blank."""


def problems(study: Study) -> Iterator[Problem]:
    """Yield problems between intervals, questions, procedures or pairs, and the stimulus table."""
    if study.intervals is None:
        return
    if bool(study.procedure) == (study.pairs is not None):
        found = "both" if study.procedure else "neither"
        yield Problem(("procedure",), f"{{kind, level, ...}}, or pairs: {{}} in its place, is expected, found {found}")
        return
    if study.intervals.equal and (study.pairs is None or study.intervals.design != "forced_choice"):
        yield Problem(("intervals", "equal"), "a further answer of pairs, which of two is chosen: with pairs: {} alone")
    about = [question for question in study.ask if question.is_about_intervals]
    if study.ask and len(about) != 1:
        yield Problem(("ask",), f"one question of: intervals is expected, found {len(about)}")
    for n, question in enumerate(study.ask):
        if question.is_about_intervals and question.optional:
            yield Problem(("ask", n, "optional"), "the question of: intervals cannot be optional")
    if study.pairs is not None:
        yield from [*_pairs(study), *_devices(study)]
        return
    if study.intervals.design in COMPARED and study.intervals.standard is None:
        compares = (
            f"design {study.intervals.design} compares a stimulus with a standard: its id, or its level; or pairs"
        )
        yield Problem(("intervals",), f"standard: {compares}")
    if study.order.repeats != 1:
        yield Problem(("order", "repeats"), "how often a level is presented is a matter of the procedure; leave it out")
    rows = [procedure.grids[0].of is not None for procedure in study.procedure]
    if any(rows) != all(rows):
        yield Problem(("procedure",), "of: stimuli is expected for all procedures or for none")
    problems = [*_standard(study, any(rows)), *_names(study)]
    for n, procedure in enumerate(study.procedure):
        problems += _levels(study, procedure, procedure_path(study, n))
    problems += _devices(study)
    yield from problems
    if not problems:
        yield from _coverage(study)


def notes(study: Study) -> Iterator[str]:
    """Yield what the study file says of guessing that its design contradicts: no mistake, but rarely meant."""
    chance = study.intervals.chance if study.intervals is not None and study.procedure else None
    if chance is None:
        return
    from palpate.protocols.procedures import values_of

    declared = {
        ".".join(map(str, (*procedure_path(study, n), "model.guess"))): values_of(procedure.model.guess)
        for n, procedure in enumerate(study.procedure)
        if procedure.kind == "questplus"
    }
    if study.simulation is not None and study.simulation.observer is not None:
        declared["simulation.observer.guess"] = (study.simulation.observer.guess,)
    for name, rates in declared.items():
        if all(abs(rate - chance) > ROUNDED for rate in rates):
            found = f"{name} is {', '.join(f'{rate:g}' for rate in rates)}"
            yield f"{found}; who guesses among {len(study.intervals.answers)} intervals is right in {chance:.2g}"


def _pairs(study: Study) -> Iterator[Problem]:
    """Yield problems between pairs and the rest of the study."""
    intervals, choice = study.intervals, study.intervals.design == "forced_choice"
    fits = {"forced_choice": intervals.of == 2, "yes_no": False}
    practice = study.practice
    asked = bool(study.ask) and all(question.text for question in study.ask if question.is_about_intervals)
    goal = practice is not None and practice.until is not None
    odd = practice is not None and len(practice.stimuli) % 2 == 1
    observer = study.simulation is not None and study.simulation.observer is not None
    same = (intervals.design == "same_different") != (study.pairs.same > 0)
    example = "{name: rougher, kind: choice, of: intervals, text: 'Which one was rougher?'}"
    wrong: list[tuple[bool, Path, str]] = [
        (not fits.get(intervals.design, True), ("intervals",),
         "pairs are felt in two intervals, or with design: oddity in three or more"),
        (intervals.standard is not None, ("intervals", "standard"),
         "pairs have no standard: each stimulus is compared with the others"),
        (intervals.catch is not None, ("intervals", "catch"), "catch trials belong to procedures"),
        (same, ("pairs",), "same: N, pairs of equal stimuli, goes together with design: same_different"),
        (choice and study.feedback is not None, ("feedback",), "which of a pair is chosen is neither right nor wrong"),
        (choice and not asked, ("ask",), f"what is asked about a pair? [{example}] is expected"),
        (goal, ("practice", "until"), "practice until a goal belongs to procedures"),
        (odd, ("practice", "stimuli"), "two stimuli for each pair are expected"),
        (observer, ("simulation", "observer"), "pairs are judged by latents: {QUESTION: ...}, without a threshold"),
    ]  # fmt: skip
    yield from (Problem(path, message) for is_wrong, path, message in wrong if is_wrong)
    columns = {column for selection in study.groups.values() for column in selection}
    columns |= set() if study.order.blocks is None else {study.order.blocks.by}
    if any(column not in stimulus.columns for column in columns for stimulus in study.stimuli):
        return
    for group in study.groups or (None,):
        sizes = {name: len(several) for name, several in study.by_block(study.stimuli_of(group)).items()}
        where = "" if group is None else f"group {group}: "
        for name, size in sizes.items():
            if size < 2:
                yield Problem(("stimuli",), f"{where}two stimuli or more are expected for pairs ({name})")
            elif study.pairs.rounds is not None and study.pairs.rounds > rounds_of_all(size):
                all_met = f"{rounds_of_all(size)} rounds have all pairs of {size} stimuli ({name})"
                yield Problem(("pairs", "rounds"), f"{where}{all_met}; leave rounds out")
        total = study.order.repeats * sum(map(study.pairs.count, sizes.values()))
        if total > MOST_PAIRS:
            yield Problem(
                ("pairs",),
                f"{where}{total} trials, more than {MOST_PAIRS}; order.blocks or rounds make fewer",
            )


def _standard(study: Study, rows: bool) -> Iterator[Problem]:
    standard, ids = study.intervals.standard, [stimulus.id for stimulus in study.stimuli]
    path: Path = ("intervals", "standard")
    if standard is not None and str(standard) not in ids and not isinstance(standard, int | float):
        yield Problem(path, f"found {standard!r}, expected a stimulus id or a level; {nearest(str(standard), ids)}")
    if rows and (standard is None or str(standard) not in ids):
        yield Problem(path, "of: stimuli needs a standard: the id of one stimulus of the table")
    two = any(len(procedure.grids) > 1 for procedure in study.procedure)
    if two and standard is not None and str(standard) not in ids:
        yield Problem(path, "a level as a standard has one dimension, and the procedure has two; name a stimulus")


def _names(study: Study) -> Iterator[Problem]:
    """Yield problems of names that are used and not there, or that mean something else."""
    ids = [stimulus.id for stimulus in study.stimuli]
    by = study.order.blocks.by if study.order.blocks is not None else None
    blocks = sorted({stimulus.columns.get(by, "") for stimulus in study.stimuli}) if by is not None else []
    if PRACTICE in ids or PRACTICE in blocks:
        yield Problem(("stimuli",), f"{PRACTICE!r} is the name of the practice trials; choose another one")
    standard = study.intervals.standard
    for n, name in enumerate(study.practice.stimuli if study.practice is not None else ()):
        if standard is not None and name == str(standard):
            yield Problem(
                ("practice", "stimuli", n), f"{name!r} is the standard, which is in no track; name another one"
            )
    observer = study.simulation.observer if study.simulation is not None else None
    if observer is not None and isinstance(observer.threshold, dict):
        named = [procedure.name for procedure in study.procedure]
        tracks = [
            *ids,
            *(f"{name} {procedure}" for name in [*ids, *blocks, "main"] for procedure in named),
            *blocks,
            "main",
        ]
        for name in observer.threshold:
            if name not in tracks:
                path: Path = ("simulation", "observer", "threshold", name)
                yield Problem(path, f"found {name!r}, expected a stimulus or a track; {nearest(name, ids)}")


def _devices(study: Study) -> Iterator[Problem]:
    """Yield problems between intervals, levels and the need that presents them."""
    needs = [NEEDS[need] for need in study.needs]
    presenting = next((need for need in needs if need.role == "presents" and not need.makes), None)
    if presenting is None:
        return
    intervals: Intervals = study.intervals
    if not presenting.parameters:
        known = ", ".join(name for name, need in NEEDS.items() if need.parameters)
        yield Problem(("needs",), f"task intervals is presented by {known}, or by samples that are placed by hand")
        return
    if intervals.at_once:
        yield Problem(("intervals", "at_once"), "one device presents the stimuli: it cannot present two at once")
    if study.procedure and intervals.standard is None and intervals.seconds is None:
        yield Problem(("intervals",), "seconds: N is expected: how long is an interval that is blank?")
    for n, procedure in enumerate(study.procedure):
        for k, grid in enumerate(procedure.grids):
            if grid.of is None and grid.column not in presenting.parameters:
                known = nearest(grid.column, sorted(presenting.parameters))
                place = ("level", k, "column") if len(procedure.grids) > 1 else ("level", "column")
                path = (*procedure_path(study, n), *place)
                yield Problem(path, f"the column {grid.column!r} changes nothing that is presented; {known}")


def _levels(study: Study, procedure: Any, path: Path) -> Iterator[Problem]:
    """Yield problems between a procedure and the stimulus table."""
    ids = [stimulus.id for stimulus in study.stimuli]
    for n, name in enumerate(procedure.stimuli or ()):
        if name not in ids:
            yield Problem((*path, "stimuli", n), f"found {name!r}, expected a stimulus id; {nearest(name, ids)}")
    grid = procedure.grids[0]
    if grid.of is None:
        return
    values = [stimulus.columns.get(grid.column, "") for stimulus in study.stimuli]
    if bad := [n for n, value in enumerate(values) if not is_number(value)]:
        found = f"stimulus {ids[bad[0]]!r} has {values[bad[0]]!r} in {grid.column!r}"
        yield Problem((*path, "level", "column"), f"{found}, not a finite number")
        return
    if procedure.kind == "questplus" and procedure.needs_positive_levels and min(map(float, values)) <= 0:
        yield Problem((*path, "level"), "a Weibull function on a linear scale needs levels above 0; or say scale: db")


def _coverage(study: Study) -> Iterator[Problem]:
    """Yield problems of groups and blocks without a track, and of starts and levels within each of them."""
    by = study.order.blocks.by if study.order.blocks is not None else None
    if by is not None and any(by not in stimulus.columns for stimulus in study.stimuli):
        return
    covered: set[str] = set()
    for group in study.groups or (None,):
        for block, members in sorted(study.by_block(study.stimuli_of(group)).items()):
            where = f" of block {block}" if by is not None else f" of group {group}" if group is not None else ""
            tracks = tracks_in(study, block, members, ())
            covered |= {stimulus.id for track in tracks for stimulus in track.stimuli}
            if not tracks:
                yield Problem(("procedure",), f"no procedure is for the stimuli{where}")
            for track in tracks:
                if len(track.levels) < 2:
                    yield Problem(("procedure",), f"track {track.name!r} has fewer than two levels")
                if len(set(track.levels)) < len(track.levels):
                    yield Problem(("procedure",), f"track {track.name!r}: two stimuli have one level")
                start = getattr(track.procedure, "start", None)
                if start is not None and float(start) not in track.levels:
                    levels = ", ".join(map(str, track.levels))
                    path = (*procedure_path(study, study.procedure.index(track.procedure)), "start")
                    yield Problem(path, f"{start} is not a level of track {track.name!r}: {levels}")
    standard = study.intervals.standard
    for stimulus in study.stimuli:
        if stimulus.id not in covered and (standard is None or stimulus.id != str(standard)):
            yield Problem(("procedure",), f"no procedure is for the stimulus {stimulus.id!r}, which is never presented")
