"""Texts beside the numbers: they are plainly harmless, or part of a question."""

# ruff: noqa: RUF001  Texts of labs have letters of all scripts.

import time

import pytest

from validate.readings.beside import changes, is_harmless

HARMLESS = (
    "gez. Lehmann|Datum: 17.06.2025, Uhrzeit 9:45|Temperature: 19.5 °C|visto, Marta|Bearbeiter M. Muster|"
    "Datum 3.5.2026 Prüfer Meier|Raumtemperatur 21,4|Bemerkung: keine|Photo: IMG_2231.jpg|Prüfbericht 12/26|"
    "Labor 3|ok; Foto 1, Blatt 2"
)
CHANGING = (
    "all values in inches|checked: zero is on a 5 mm block|add 1.5 to each|Vorzeichen umgekehrt|"
    "mesuré depuis l'extrémité droite|lectures prises de droite à gauche|valori in pollici|"
    "calço de 5 mm por baixo do pé|afstandhouder van 5 mm onder de voet|5 mm välikappale jalan alla|除以10|"
    "измерено от правого конца|Anna: please halve all readings|Medido por Luis, en centímetros|"
    "Zmierzył Jan, wartości w cm|Plåt 2 mm under mätaren|卡尺下面有2毫米垫片|Operator J.K., scale was turned|"
    "Herr Klein hat einen anderen Nullpunkt genommen|lectura con galga de 3 mm|Laborant Kees: alles in cm|"
    "Lisa: allt i cm|测量取消|"
    "Observación: en pulgadas|Měřítko s podložkou 2 mm|测量人陈静：倒序|Operator changed, new zero|"
    "lignes 4 à 6 annulées|Laborantti Aino: cm"
)
"""Texts with a word that may change readings."""
UNKNOWN = (
    "copied from E4, arrived 3 maj|měřeno od pravého konce|10'a bölünecek|"
    "Notes: each number is the sum of two gauges|la cota se toma desde la base|Anna read it from the other bank|"
    "nothing valid after row 6|dal basso verso l'alto|gauge reads 5.00 when flush with the face|pomiar nieważny|"
    "geçersiz|Photo 3: the first reading is from the neighbouring crack|Mittasi Matti, arvot senttimetreinä|"
    "échantillon retourné|Matti: kaikki sentteinä|Photo credit: none, gauge sat on the label|mauvaise fissure|"
    "este valor é suspeito|posuvka stála šikmo|az ablaktól mérve|Sunny, sealant still soft|Měřila Eva, pozpátku|"
    "Stored flat, measured tilted|filas 4 a 6 nulas|met vulplaatje"
)
"""Texts that change readings by words of no list."""
BETWEEN = (
    "Operator: values in inch|Prüfer: links|Measured From Far Edge|no|?|+|no signal|5|Operator 5|gauge 5.00|"
    "gauge -5|Photo 5,00|Messschieber in Zoll|Caliper: zero at 0.01 mm|45 %|foto 3 gemaakt. daarna andersom|"
    "Probe Rückseite|P02|Seite 2|Projekt 88, Probe 89|Regal 3, P05|样品5号|Operator: Anna Meier, Werte in Fuß|"
    "gestrichen: A. Meier|Measured on Plate|gemessen mit Messbrücke|recorded order C, B, A|zero not on face|"
    "Nullpunkt auf der Probe|vylomené zrno na hraně - platí jen 1. hodnota|"
    "bolla d'aria sotto la punta -> scartare|عينة محفوظة|记录：估计值"
)
"""A harmless label, instrument or empty word with more beside it; unknown words and scripts."""
SENTENCES = (
    "Foto Unterseite|Projekt Nachmessung|Sheet Back|"
    "Measured by J. Smith on 12 May 2025|Danke an die Kollegen vom Labor|Operator: Anna Maria Klara Meier|"
    "Anna Meier|zero on surface|pluie le matin|Laborantka: Ola Nowak|замечаний нет|测量由李娜完成"
)
"""Names behind labels of items, and harmless sentences, which are asked about all the same."""


@pytest.mark.parametrize("text", ["", "-", "/", "...", "(-)", *HARMLESS.split("|")])
def test_a_text_of_known_harmless_words_needs_no_question(text):
    assert is_harmless(text)


@pytest.mark.parametrize("text", CHANGING.split("|"))
def test_a_text_that_names_a_change_of_the_readings_needs_a_question(text):
    assert changes(text)
    assert not is_harmless(text)


LABELS = ("Operator: J. Smith, ", "12.05.2025 ", "Prüfer A. Meier; ", "Photo 12 - ")
HIDDEN = [label + text for label in LABELS for text in CHANGING.split("|")[::5]]


@pytest.mark.parametrize("text", [*UNKNOWN.split("|"), *BETWEEN.split("|"), *SENTENCES.split("|"), *HIDDEN])
def test_a_text_that_is_not_fully_understood_needs_a_question(text):
    assert not is_harmless(text)


SHEETS = "Sheet1|Tabelle 1|May|P01 Messung|Feuil1|Hoja1|Blad1|Лист1|工作表1|P01|Q12 (2)|2025-05-12"
SHEETS_WITH_A_CHANGE = 'P01 inch|in inch|P01 in|P01 [in]|P01 left|P01 links|P01 nass|P01 repeat|P01 1/10|P01 +5|P01 5"'


def test_long_texts_are_checked_within_two_seconds():
    """A cell has up to 32,767 letters. Alternatives that match the same word would take 2^n steps."""
    begin = time.process_time()
    for text in ("da " * 130 + "x", "1" * 400, "1" * 32_000, "1, " * 130, "ß" * 399):
        assert not is_harmless(text)
    assert time.process_time() - begin < 2


@pytest.mark.parametrize(("names", "change"), [(SHEETS, False), (SHEETS_WITH_A_CHANGE, True)])
def test_names_of_sheets_and_files_that_state_a_change_of_readings_are_recognised(names, change):
    assert [name for name in names.split("|") if changes(name) is not change] == []


def test_only_the_name_of_the_measured_sample_needs_no_question():
    assert all(is_harmless(text, "P01") for text in ("P01", "p 01", "Sample P01, operator J. Smith"))
    others = ("P01'", "sample P01* measured by J. Smith", "P02", "P011")
    assert not any(is_harmless(text, "P01") for text in others)
