"""Where the font files of a machine lie, and which of them to prefer."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from fnmatch import fnmatch
from importlib.util import find_spec
from pathlib import Path

REGULAR = (
    "NotoSans-Regular.ttf", "NotoSans[[]*[]].ttf", "segoeui.ttf", "HelveticaNeue.ttc", "Arial.ttf", "arial.ttf",
    "DejaVuSans.ttf", "LiberationSans-Regular.ttf",
    "NotoSansKR-Regular.*", "NotoSansCJK-Regular.ttc", "NotoSansCJK-VF*.ttc", "malgun.ttf", "AppleSDGothicNeo.ttc",
    "NanumGothic.ttf", "NotoSansJP-Regular.*", "NotoSansSC-Regular.*", "YuGothR.ttc", "msyh.ttc", "PingFang.ttc",
    "NotoSansDevanagari-Regular.ttf", "Nirmala.ttf", "Nirmala.ttc", "Kohinoor.ttc", "mangal.ttf",
    "Lohit-Devanagari.ttf",
    "NotoSans*-Regular.ttf", "NotoSansSymbols*-Regular.ttf", "seguisym.ttf",
)  # fmt: skip
"""File names in order of preference: Latin with accents, then Korean and its neighbours, Devanagari, all else."""
BOLD = (
    "NotoSans-Bold.ttf", "segoeuib.ttf", "Arial Bold.ttf", "arialbd.ttf", "DejaVuSans-Bold.ttf",
    "LiberationSans-Bold.ttf", "NotoSansKR-Bold.*", "NotoSansCJK-Bold.ttc", "malgunbd.ttf", "NanumGothicBold.ttf",
    "NotoSansDevanagari-Bold.ttf", "NirmalaB.ttf", "NotoSans*-Bold.ttf",
)  # fmt: skip
ENDINGS = (".ttf", ".ttc", ".otf", ".otc")


def font_files(folders: Sequence[Path] | None = None) -> dict[str, Path]:
    """Font files by name below the folders (default: the system's); of equal names the first one found counts."""
    found: dict[str, Path] = {}
    for folder in system_folders() if folders is None else folders:
        for place, inner, names in os.walk(folder):
            inner.sort()
            for name in sorted(names):
                if name.lower().endswith(ENDINGS):
                    found.setdefault(name, Path(place, name))
    return found


def in_order(files: dict[str, Path], wanted: Sequence[str]) -> list[Path]:
    """The files that a list of name patterns asks for, in its order, each once."""
    chosen: dict[Path, None] = {}
    for pattern in wanted:
        exact = pattern in files
        names = [pattern] if exact else sorted(name for name in files if fnmatch(name, pattern))
        chosen.update((files[name], None) for name in names)
    return list(chosen)


def system_folders(platform: str = sys.platform) -> tuple[Path, ...]:
    """Where this kind of system keeps fonts; last, those of matplotlib, so that Latin can be drawn."""
    home = Path.home()
    own: tuple[Path, ...]
    if platform == "win32":
        local = Path(os.environ.get("LOCALAPPDATA", home / "AppData/Local"))
        own = (Path(os.environ.get("WINDIR", "C:/Windows"), "Fonts"), local / "Microsoft/Windows/Fonts")
    elif platform == "darwin":
        own = (home / "Library/Fonts", Path("/Library/Fonts"), Path("/System/Library/Fonts"))
    else:
        shared = os.environ.get("XDG_DATA_DIRS") or "/usr/local/share:/usr/share"
        data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local/share")
        own = (data / "fonts", home / ".fonts", *(Path(each, "fonts") for each in shared.split(":") if each))
    return (*own, *_of_matplotlib())


def _of_matplotlib() -> tuple[Path, ...]:
    spec = find_spec("matplotlib")
    if spec is None or spec.origin is None:
        return ()
    return (Path(spec.origin).parent / "mpl-data/fonts/ttf",)
