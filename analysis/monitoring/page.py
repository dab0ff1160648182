"""The monitor's page as HTML: live with its small script, or as one self-contained file."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.analysis.monitoring import drawings, words
from palpate.analysis.monitoring.sessions import Session
from palpate.analysis.monitoring.watching import Snapshot
from palpate.analysis.reports.page import environment, style
from palpate.analysis.reports.tables import NONE
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).resolve().parent / "templates"
SHOWN_AT_ONCE = 12
REFRESH_S = 2
FIRST = ("running", "interrupted")


def _templates() -> Environment:
    """Return the page's templates with the texts and drawings that they use."""
    filters = {name: getattr(words, name) for name in ("duration", "rough", "clock", "exact_clock", "sign")}
    helpers = {"drawings": drawings, "STATUS": words.STATUS, "NONE": NONE, "SHOWN": SHOWN_AT_ONCE, "REFRESH": REFRESH_S}
    return environment(TEMPLATES, helpers={**helpers, "count": count}, filters=filters)


@dataclass
class Pages:
    """A writer of the page that caches its long, rarely changing parts."""

    templates: Environment = field(default_factory=_templates)
    parts: dict[tuple[str, str], tuple[Any, Any]] = field(default_factory=dict)
    rows: dict[tuple[Any, ...], tuple[Session, Any, Any]] = field(default_factory=dict)

    def fragment(self, snapshot: Snapshot) -> str:
        """Return the part of the page that changes."""
        return self._rendered("fragment.html", self._view(snapshot))

    def live(self, snapshot: Snapshot, nonce: str) -> str:
        """Return the page with its style and script, both with the nonce of the Content-Security-Policy header."""
        return self._page(snapshot, nonce)

    def still(self, snapshot: Snapshot) -> str:
        """Return the page as one file without external resources and scripts."""
        return self._page(snapshot, None)

    def _page(self, snapshot: Snapshot, nonce: str | None) -> str:
        css = style(("report.css",), TEMPLATES / "monitor.css")
        return self._rendered("page.html", {"nonce": nonce, "css": css, **self._view(snapshot)})

    def _rendered(self, template: str, view: dict[str, Any]) -> str:
        html: str = self.templates.get_template(template).render(view)
        return html

    def _view(self, snapshot: Snapshot) -> dict[str, Any]:
        sessions = sorted(snapshot.sessions, key=_urgency)
        alike: dict[str, Any] = {
            "one_study": len({session.study for session in sessions}) == 1,
            "all_simulated": bool(sessions) and all(session.simulated for session in sessions),
        }
        alike["row"] = self._row_writer({"lab": snapshot, **alike})
        flagged_first = sorted(
            (session for session in sessions if session.rated is not None),
            key=lambda rater: (-len(rater.rated.flags if rater.rated else ()), rater.participant),
        )
        raters = {
            study.digest: [session for session in flagged_first if session.digest == study.digest]
            for study in snapshot.balances
        }
        studies = []
        for study in snapshot.balances:
            own, several = raters[study.digest], sum(other.study == study.study for other in snapshot.balances) > 1
            view = {"study": study, "several": several, "raters": own, **alike}
            who = tuple(
                (rater.participant, rater.number, rater.withdrawn, rater.simulated, rater.rated) for rater in own
            )
            shared = {name: value for name, value in alike.items() if name != "row"}
            balance = self._part("balance.html", (study, several), view)
            studies.append((balance, self._part("raters.html", (who, several, shared), view) if own else ""))
        notes = [(session, note) for session in sessions for note in session.notes]
        parts = {"balances": [one for one, _ in studies], "raters": [one for _, one in studies if one]}
        facts = []
        number_of = Counter(session.status for session in snapshot.sessions)
        facts.append(("Running", number_of["running"]))
        facts.append(("Complete", number_of["complete"]))
        facts.append(("Interrupted", number_of["interrupted"]))
        if ended_early := number_of["aborted"] + number_of["declined"] + number_of["ineligible"]:
            facts.append(("Aborted, declined or not eligible", ended_early))
        facts.append(
            ("Raters with a flag", sum(bool(session.rated and session.rated.flags) for session in snapshot.sessions))
        )
        if snapshot.refused:
            facts.append(("Refused ledgers", len(snapshot.refused)))
        return {"lab": snapshot, "sessions": sessions, "facts": facts, "notes": notes} | parts | alike

    def _row_writer(self, view: dict[str, Any]) -> Any:
        """Return a function that writes a session's row, cached while it and the rows' common parts are the same."""
        parts = self.templates.get_template("parts.html").make_module(view)
        day = datetime.fromtimestamp(view["lab"].at).date()
        shared = (view["one_study"], view["all_simulated"], day)

        def row(macro: str, session: Session, *how: bool) -> Any:
            name = (macro, session.file, *how)
            cached = self.rows.get(name)
            if cached is None or cached[0] is not session or cached[1] != shared:
                cached = self.rows[name] = session, shared, getattr(parts, macro)(session, *how)
            return cached[2]

        return row

    def _part(self, template: str, rests_on: Any, view: dict[str, Any]) -> Any:
        from markupsafe import Markup

        name = (template, view["study"].digest)
        if name not in self.parts or self.parts[name][0] != rests_on:
            self.parts[name] = rests_on, Markup(self._rendered(template, view))  # its template escaped what it holds
        return self.parts[name][1]


def _urgency(session: Session) -> tuple[int, float, str]:
    """Return a sort key: running sessions first, then interrupted ones, then the latest."""
    rank = FIRST.index(session.status) if session.status in FIRST else len(FIRST)
    return rank, -(session.ended_at or session.started_at or 0.0), session.file
