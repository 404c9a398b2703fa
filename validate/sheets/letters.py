"""Words as any keyboard writes them, so that spellings of one word are equal."""

import unicodedata

UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"})


def plain_letters(text: str) -> str:
    """In lower case, umlauts written out as German does (ä is ae), other accents dropped (é is e, ñ is n)."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(UMLAUTS)
    return "".join(letter for letter in unicodedata.normalize("NFD", folded) if unicodedata.category(letter) != "Mn")
