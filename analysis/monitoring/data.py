"""The monitor's snapshot as plain data for scripts."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from palpate.analysis.monitoring.balance_grid import GroupBalance
from palpate.analysis.monitoring.watching import Snapshot
from palpate.protocols.balance import Balance


def as_data(snapshot: Snapshot) -> dict[str, Any]:
    """Return the snapshot as JSON data: times in seconds, times of day in seconds since 1970."""
    return {
        "lab": snapshot.lab,
        "at": snapshot.at,
        "sessions": [
            {**asdict(session), "flags": [sign.sentence for sign in session.rated.flags] if session.rated else []}
            for session in snapshot.sessions
        ],
        "refused": [asdict(refused) for refused in snapshot.refused],
        "not_named_as_sessions": list(snapshot.others),
        "balance": [
            {
                "study": balance.study,
                "digest": balance.digest,
                "sample": dict(balance.sample),
                "groups": [_group(group) for group in balance.groups],
            }
            for balance in snapshot.balances
        ],
        "people_problem": snapshot.people_problem,
    }


def _group(group: GroupBalance) -> dict[str, Any]:
    sessions = {str(number): _certificate(balance) for number, balance in group.of_sessions.items()}
    return {
        "group": group.group,
        "design": group.design,
        "rows": group.round,
        "counts": group.counts,
        "verdict": group.verdict,
        **_certificate(group.certificate),
        **({"sessions": sessions} if sessions else {}),
        "taken": [
            {
                "row": row.place,
                "state": row.state,
                "holders": [
                    {
                        "participant": holder.participant,
                        **({} if holder.session is None else {"session": holder.session}),
                        "status": holder.status,
                    }
                    for holder in row.holders
                ],
            }
            for row in group.rows
        ],
    }


def _certificate(balance: Balance) -> dict[str, Any]:
    return {
        "balanced": balance.balanced if balance.sequences else None,
        "sequences": balance.sequences,
        "positions": balance.positions,
    }
