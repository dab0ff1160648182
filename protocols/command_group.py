"""Groups of commands that name the nearest command for one that there is not."""

from __future__ import annotations

from typing import Any

import click


class NearestGroup(click.Group):
    """A group whose error for an unknown command names the nearest one; `called` is what its commands are called."""

    called = "command"

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """Resolve a command as click does; for an unknown one, name the nearest known one."""
        known = self.list_commands(ctx)
        if args and args[0] not in known and not args[0].startswith("-"):
            from palpate.protocols.did_you_mean import nearest

            ctx.fail(f"no {self.called} {args[0]!r}; {nearest(args[0], known)}")
        return super().resolve_command(ctx, args)
