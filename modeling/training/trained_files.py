"""The files of a trained model: its card and weights, and the history and learning curve of its training.

The curve is drawn over seconds, since the duration of an epoch differs from method to method."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.analysis.figures.style import INK, OKABE_ITO, PAPER, SOFT, drawing, quiet_axes, save
from palpate.modeling.training.history import Epoch, remove_history, write_history
from palpate.modeling.training.run_card import plain_values

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


COLOURS = (INK, *OKABE_ITO)


def save_learning_curve(
    histories: Mapping[str, Sequence[Epoch]], folder: Path, name: str, last: bool = False
) -> list[Path]:
    """Draw one curve for each named training, write NAME.svg and NAME.png, and return their paths."""
    with drawing(name):
        return save(learning_curve(histories, last), folder, name)


def learning_curve(histories: Mapping[str, Sequence[Epoch]], last: bool = False) -> Figure:
    """Return a figure of log loss over seconds: held-out loss as a line, training loss dotted, the saved epoch a point.

    The saved epoch is the best one, or with `last` (`Settings.keep_last`) the last.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axes = figure.subplots()
    for (name, history), colour in zip(histories.items(), cycle(COLOURS), strict=False):
        _draw(axes, name, history, colour, last)
    epochs = [epoch for history in histories.values() for epoch in history]
    from matplotlib.ticker import LogLocator, StrMethodFormatter

    quiet_axes(axes)
    lowest = min(min(epoch.watched, epoch.train_loss) for epoch in epochs)
    if lowest > 0:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.set_ylim(bottom=lowest * 0.8)
    axes.minorticks_off()
    axes.set_xlim(left=0)
    axes.set_xlabel("seconds of training", color=SOFT)
    axes.set_ylabel("loss", color=SOFT)
    held = any(epoch.held_loss is not None for epoch in epochs)
    axes.set_title("Loss on held-out rows (dotted: while training)" if held else "Loss while training")
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.16), frameon=False, fontsize=8)
    return figure


def _draw(axes: Axes, name: str, history: Sequence[Epoch], colour: str, last: bool) -> None:
    """Draw the curves of one training."""
    seconds = [epoch.seconds for epoch in history]
    if any(epoch.held_loss is not None for epoch in history):
        losses = [epoch.train_loss for epoch in history]
        axes.plot(seconds, losses, color=colour, linewidth=1.0, linestyle=(0, (1, 1.5)), alpha=0.7)
    saved = history[-1] if last else min(history, key=lambda epoch: epoch.watched)
    text = f"{saved.watched:.3g} after {saved.seconds:.3g} s (epoch {saved.epoch} of {history[-1].epoch})"
    label = f"{name}: {text}" if name else f"{'last' if last else 'best'} {text}"
    axes.plot(seconds, [epoch.watched for epoch in history], color=colour, linewidth=1.6, label=label)
    axes.plot(saved.seconds, saved.watched, "o", color=colour, markersize=5.5, markeredgecolor=PAPER)


@dataclass(frozen=True)
class Written:
    """A model on disk: its card, its method, the metrics of its card, and its files (the card first)."""

    card: Path
    method: str
    metrics: Mapping[str, float]
    files: tuple[Path, ...]

    def plain(self) -> dict[str, Any]:
        """Return the model's description as JSON holds it."""
        return dict(plain_values(self))


def write_trained(
    folder: Path, write: Callable[[Path], Path], history: Sequence[Epoch], last: bool = False
) -> tuple[Path, ...]:
    """Write a model, and its training history as a table and as pictures; return its files, the card first.

    `write` writes card and weights into the folder and returns the card's path. The history and learning curve of an
    older model of this name are removed. `last`: the last epoch was saved, not the best. Raises the errors of `write`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    card = write(folder)
    files = (card, card.with_suffix(".safetensors"))
    remove_history(folder, card.stem)
    if not history:
        return files

    table = write_history(history, folder / f"{card.stem}.history.csv")
    return (*files, table, *save_learning_curve({"": history}, folder, f"{card.stem}.history", last))
