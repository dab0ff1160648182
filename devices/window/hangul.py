"""Hangul from Latin keys: the two-set layout (dubeolsik, KS X 5002), for windows without an input method.

A letter is a compatibility jamo, as a key writes it; a syllable is one character, made of a lead, a vowel and a tail.
"""

from __future__ import annotations

LEADS = "ㄱㄲㄴㄷㄸㄹㅁㅂㅃㅅㅆㅇㅈㅉㅊㅋㅌㅍㅎ"
VOWELS = "ㅏㅐㅑㅒㅓㅔㅕㅖㅗㅘㅙㅚㅛㅜㅝㅞㅟㅠㅡㅢㅣ"
TAILS = " ㄱㄲㄳㄴㄵㄶㄷㄹㄺㄻㄼㄽㄾㄿㅀㅁㅂㅄㅅㅆㅇㅈㅊㅋㅌㅍㅎ"
"""In the order of Unicode's syllables, which begin at FIRST; a space stands for no tail."""
FIRST, LAST = ord("가"), ord("힣")
PAIRS = {
    "ㄱㅅ": "ㄳ", "ㄴㅈ": "ㄵ", "ㄴㅎ": "ㄶ", "ㄹㄱ": "ㄺ", "ㄹㅁ": "ㄻ", "ㄹㅂ": "ㄼ", "ㄹㅅ": "ㄽ", "ㄹㅌ": "ㄾ",
    "ㄹㅍ": "ㄿ", "ㄹㅎ": "ㅀ", "ㅂㅅ": "ㅄ", "ㅗㅏ": "ㅘ", "ㅗㅐ": "ㅙ", "ㅗㅣ": "ㅚ", "ㅜㅓ": "ㅝ", "ㅜㅔ": "ㅞ",
    "ㅜㅣ": "ㅟ", "ㅡㅣ": "ㅢ",
}  # fmt: skip
"""Pairs of keys that make one vowel or one tail; ㄲ, ㅆ and similar letters have keys of their own."""
PARTS = {pair: keys for keys, pair in PAIRS.items()}
_PLAIN = dict(zip("qwertyuiopasdfghjklzxcvbnm", "ㅂㅈㄷㄱㅅㅛㅕㅑㅐㅔㅁㄴㅇㄹㅎㅗㅓㅏㅣㅋㅌㅊㅍㅠㅜㅡ", strict=True))
_SHIFTED = {"Q": "ㅃ", "W": "ㅉ", "E": "ㄸ", "R": "ㄲ", "T": "ㅆ", "O": "ㅒ", "P": "ㅖ"}
KEYS = _PLAIN | {key.upper(): jamo for key, jamo in _PLAIN.items()} | _SHIFTED
"""What each key writes; Shift changes seven of them."""


def needed(language: str, platform: str) -> bool:
    """Return whether Hangul must be composed here: on Windows and macOS, input methods work in the window."""
    return language.split("-", maxsplit=1)[0] == "ko" and platform not in ("win32", "darwin")


def joined(before: str, jamo: str) -> str:
    """Return the composed character after another letter: unchanged, changed, or unchanged with a new one."""
    lead, vowel, tail = parts(before)
    if jamo in VOWELS and tail:
        moves = PARTS.get(tail, tail)[-1]
        return syllable(lead, vowel, PARTS.get(tail, "")[:1]) + syllable(moves, jamo)
    if jamo in VOWELS and lead and not vowel:
        return syllable(lead, jamo)
    if jamo in VOWELS and vowel + jamo in PAIRS:
        return syllable(lead, PAIRS[vowel + jamo])
    if lead and vowel and not tail and jamo in TAILS:
        return syllable(lead, vowel, jamo)
    if tail + jamo in PAIRS:
        return syllable(lead, vowel, PAIRS[tail + jamo])
    return before + jamo


def shortened(before: str) -> str:
    """Return the composed character after its last key was deleted; "" if it was the only one."""
    lead, vowel, tail = parts(before)
    if tail:
        return syllable(lead, vowel, PARTS[tail][0] if tail in PARTS else "")
    if vowel in PARTS:
        return syllable(lead, PARTS[vowel][0])
    return lead if vowel else ""


def parts(character: str) -> tuple[str, str, str]:
    """Return (lead, vowel, tail) of a syllable or a lone letter.

    A missing part is empty; all are empty for other characters.
    """
    if len(character) == 1 and FIRST <= ord(character) <= LAST:
        rest, tail = divmod(ord(character) - FIRST, len(TAILS))
        lead, vowel = divmod(rest, len(VOWELS))
        return LEADS[lead], VOWELS[vowel], TAILS[tail].strip()
    if not character or character not in LEADS + VOWELS:
        return "", "", ""
    return ("", character, "") if character in VOWELS else (character, "", "")


def syllable(lead: str, vowel: str, tail: str = "") -> str:
    """Return the character of these letters; without a lead, the vowel alone."""
    if not lead:
        return vowel
    place = (LEADS.index(lead) * len(VOWELS) + VOWELS.index(vowel)) * len(TAILS)
    return chr(FIRST + place + TAILS.index(tail or " "))
