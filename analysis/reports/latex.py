"""Tables in LaTeX: special characters are escaped, wide tables are in small type or on rotated pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from palpate.analysis.reports.tables import Head, NumberedTable, table_letters

PACKAGES = "booktabs,longtable,pdflscape"
_GREEK = {
    "α": "alpha", "β": "beta", "γ": "gamma", "δ": "delta", "ε": "varepsilon", "η": "eta", "θ": "theta", "κ": "kappa",
    "λ": "lambda", "μ": "mu", "ν": "nu", "π": "pi", "ρ": "rho", "σ": "sigma", "τ": "tau", "φ": "varphi", "χ": "chi",
    "ψ": "psi", "ω": "omega", "Δ": "Delta", "Σ": "Sigma", "Φ": "Phi", "Ω": "Omega", "±": "pm", "≥": "geq", "≤": "leq",
    "≠": "neq", "≈": "approx", "×": "times", "→": "rightarrow", "←": "leftarrow", "∞": "infty", "−": "relax-",
}  # fmt: skip
LETTERS: Mapping[str, str] = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': r"\textquotedbl{}", "`": r"\textasciigrave{}", "'": r"\textquotesingle{}", "-": "-{}",
    "[": "{[}", "]": "{]}", "*": "{*}", "–": "--", "—": "---", "°": r"$^\circ$", "…": r"\dots{}", "²": "$^2$",
    "′": r"$'$", "\xa0": "~", "\t": " ", "\n": " ", "\r": " ",
    **{letter: rf"$\{name}$" for letter, name in _GREEK.items()},
    **{sign: f"$^{digit}$" for digit, sign in enumerate("⁰¹²³⁴⁵⁶⁷⁸⁹")},
    **{sign: f"$_{digit}$" for digit, sign in enumerate("₀₁₂₃₄₅₆₇₈₉")},
}  # fmt: skip
SIZES = ((88, r"\small", 4), (104, r"\footnotesize", 3))
"""By size of type and space between columns in points: the most letters of a table that fits an upright page."""
TURNED = ((150, r"\footnotesize", 3), (185, r"\scriptsize", 2), (10**6, r"\tiny", 1.5))
"""The same for a rotated page."""


def latex_text(title: str, lead: str, tables: Sequence[NumberedTable]) -> str:
    """Return every table as a longtable with caption and label, for inclusion in a document with the encoding T1."""
    head = [f"% {one_line(title)}", f"% Needs \\usepackage[T1]{{fontenc}} and \\usepackage{{{PACKAGES}}}"]
    texts = [
        text
        for table in tables
        for row in (
            [head.name for head in table.table.heads],
            *table.table.rows,
            table.notes,
            table.table.groups.values(),
        )
        for text in (table.title, *row)
    ]
    letters = sorted({letter for text in texts for letter in text if letter not in LETTERS and letter > "ſ"})
    if letters:
        head.append(f"% Holds letters that pdflatex does not know (lualatex does): {' '.join(letters)}")
    leads = [escaped(lead)] if lead else []
    return "\n\n".join(["\n".join(head), *leads, *map(_table, tables)]) + "\n"


def one_line(text: str) -> str:
    """Return a text without line breaks and control characters."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def escaped(text: str) -> str:
    """Return a text that TeX typesets unchanged."""
    return "".join(LETTERS.get(letter, letter) for letter in one_line(text))


def _table(numbered: NumberedTable) -> str:
    width = table_letters(numbered.table)
    turned = width > SIZES[-1][0]
    size, gap = next((size, gap) for most, size, gap in (TURNED if turned else SIZES) if width <= most)
    table = numbered.table
    head = [r"\toprule", " & ".join(map(_head, table.heads)) + r" \\", r"\midrule"]
    name = "".join(letter if letter.isascii() and letter.isalnum() else "-" for letter in numbered.name)
    sides = "".join({"number": "r", "words": r"p{5cm}"}.get(head.kind, "l") for head in table.heads)
    lines = ["{", size, rf"\setlength{{\tabcolsep}}{{{gap}pt}}"]
    lines += [rf"\begin{{longtable}}{{@{{}}{sides}@{{}}}}", rf"\caption{{{escaped(numbered.title)}}}"]
    lines += [rf"\label{{tab:{name}}}\\", *head, r"\endfirsthead", *head, r"\endhead", r"\bottomrule", r"\endfoot"]
    for place, row in enumerate(table.rows):
        if place in table.groups:
            lines += [rf"\multicolumn{{{len(table.heads)}}}{{@{{}}l}}{{\itshape {escaped(table.groups[place])}}}\\*"]
        lines.append(" & ".join(map(escaped, row)) + r" \\")
    lines += [r"\end{longtable}", "}"]
    lines += [rf"{{\noindent\footnotesize {escaped(note)}\par}}" for note in numbered.notes]
    return "\n".join([r"\begin{landscape}", *lines, r"\end{landscape}"] if turned else lines)


def _head(head: Head) -> str:
    """Return the head of a column, with its words on separate lines."""
    words = head.name.split()
    side = "r" if head.kind == "number" else "l"
    stacked = r"\\".join(map(escaped, words))
    return rf"\shortstack[{side}]{{{stacked}}}" if len(words) > 1 else escaped(head.name)
