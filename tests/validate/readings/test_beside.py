"""Texts beside the numbers, in 23 languages: harmless, or part of a question."""

# ruff: noqa: RUF001  Texts of labs have letters of all scripts.

import time

import pytest

from validate.readings.beside import changes, is_harmless

HARMLESS = (
    "Measured by J. Smith on 12 May 2025|weather: sunny, light wind|"
    "Please send results to lab@example.com|Raumtemperatur 22 °C, Luftfeuchte 45 %|"
    "Danke an die Kollegen vom Labor|Rien à signaler|Rapport signé le 12/06/2025|"
    "calibre digital nº 1203, 0-150 mm|nessuna osservazione|Operador: João Silva|"
    "Gemeten door P. de Vries op 14-03-2025|Zmierzył: Jan Kowalski|Data pomiaru: 12.05.2025|"
    "Zakázka 2025/18, objednatel: Město Brno|Uppmätt av K. Larsson|"
    "Numune 3 numaralı dolapta saklanıyor|fénykép a laborban készült|照片在实验室拍摄|замечаний нет|"
    "Photo folder: 2025/June/Ring Road|gez. Lehmann|client = Skanska|Tom H., raining again|"
    "Realizado por: Carmen Ortega, técnico de laboratorio|Próbka pobrana z ulicy Długiej|"
    "Mätningarna gjordes av Erik Svensson|测量由李娜完成|kontrollerad av B. Lind 2025-05-12|"
    "Datum: 17.06.2025, Uhrzeit 9:45|armoire 2, tiroir 4|Tempo piovoso|Operator: Piotr Zieliński|"
    "Operatör: Lisa Berg|Labor 3, polc 2|It was raining all day|Numéro de commande 78412|"
    "umidità 50 %|Protokol č. 15/2025|報告書番号 2025-15|Customer: Highways North|"
    "Échantillon rangé dans la boîte 4|Misurato da Paolo Neri, 12/05/2025|Céu nublado|"
    "Měřila Eva Malá, 12.05.2025|Numune 5 numaralı rafta|Образец на полке 5|Temperature: 19.5 °C|"
    "Probe wurde am 2. Juni 2025 geliefert|pluie le matin|firma P. Gallo|Laborantka: Ola Nowak|"
    "Teknisyen: Can Öz|měřila Hanka, zapsal Jirka|dalej pisze Kasia, bo Tomek ma zajęcia|visto, Marta|確認済 佐藤|"
    "Crack sealant level, sheet 4 of 9, K. Obuya|Proefstuk ligt in kast 3, onderste plank.|"
    "pics are on Dannys phone (IMG_2231 to 2240), will upload tmrw|sigue en la hoja 2|tady došla propiska, dál tužkou"
    "|Оригинал протокола в шкафу у Петровой|folytatás a 4. oldalon|记录：小李，复核：王工"
    "|Anna Meier|시료 보관|vihko 4, sivu 37|vu le 21.06, signé M. Lacombe|foto cekildi no 18"
    "|Nullpunkt = Probenoberfläche|zero on surface|zéro sur la face|nula na povrchu vzorku|零点在试样表面"
)
CHANGING = (
    "all values in inches|rows 4 to 6 rejected, see repeat below|checked: zero is on a 5 mm block|"
    "readings doubled by mistake|add 1.5 to each|Einheit: Zoll|copied from E4, arrived 3 maj|"
    "Messung wiederholt, erste verworfen|Vorzeichen umgekehrt|gegenüber der Tischplatte gemessen|"
    "mesuré depuis l'extrémité droite|le zéro est au fond de la fissure|"
    "lectures prises de droite à gauche|restar 5 mm|valori in pollici|segno invertito|"
    "calço de 5 mm por baixo do pé|zero na mesa|afstandhouder van 5 mm onder de voet|"
    "mierzone od prawego końca|měřeno od pravého konce|nula je na stole|"
    "5 mm välikappale jalan alla|5 mm distans under foten|10'a bölünecek|数值单位为英寸|除以10|"
    "足の下に5mmのスペーサー|измерено от правого конца|All numbers are thou.|"
    "Anna: please halve all readings|Ablesung unsicher wegen Spiegelung|"
    "Medido por Luis, en centímetros|Este ponto foi anulado|Zmierzył Jan, wartości w cm|"
    "Pod měřidlem byl plech 2 mm|Plåt 2 mm under mätaren|Péter mérte, centiméterben|卡尺下面有2毫米垫片|"
    "Измерил Петров, в сантиметрах|Operator J.K., scale was turned|Not measured, estimated|"
    "Herr Klein hat einen anderen Nullpunkt genommen|Mesure faite sur l'autre fissure|"
    "lectura con galga de 3 mm|Técnico Rita: tudo em cm|Laborant Kees: alles in cm|"
    "początek z prawej|Lisa: allt i cm|başlangıç sağda|测量取消|測定中止|"
    "Notes: each number is the sum of two gauges|Every second station left out|"
    "la cota se toma desde la base|värdena ska dubblas|"
    "Anna read it from the other bank|Foto vom rechten Ende|Observación: en pulgadas|"
    "Nota: em polegadas|Měřítko s podložkou 2 mm|Skjutmått på 2 mm kloss|测量人陈静：倒序|備考：インチ|"
    "Operator changed, new zero|Anna Brown measured this on 12 June 2025 from the exit end|"
    "nothing valid after row 6|Werte um 2 zu hoch|lignes 4 à 6 annulées|valores 2 mm altos|"
    "dal basso verso l'alto|Laborante Fleur: maten in cm|Laborantti Aino: cm|技术员刘洋：厘米"
)
"""Texts with a word that may change readings."""
UNKNOWN = (
    "gauge reads 5.00 when flush with the face|el cero está en la mesa|pomiar nieważny|"
    "näyte vielä märkä|geçersiz|やり直し|Photo 3: the first reading is from the neighbouring crack|"
    "La regla estaba sobre una chapa|Mittasi Matti, arvot senttimetreinä|"
    "Photo 18 shows that the gauge was tilted|échantillon retourné|monster omgedraaid|"
    "Matti: kaikki sentteinä|mérés törölve|Photo credit: none, gauge sat on the label|"
    "Regal C, Probe Rückseite|mauvaise fissure|le quote sono riferite al banco|"
    "este valor é suspeito|wartości podwojone|posuvka stála šikmo|mätt från fönstret|"
    "az ablaktól mérve|窓側から測定|Sunny, sealant still soft|Misurato da Paolo al contrario|"
    "Měřila Eva, pozpátku|Mérte Éva, visszafelé|Stored flat, measured tilted|"
    "Fotos spiegelverkehrt|filas 4 a 6 nulas|Sample kept on its side while measured|met vulplaatje|rivit 4-6 pois"
)
"""Texts that change readings by words of no list."""
BETWEEN = (
    "Operator: values in inch|Operator: Zoll|Prüfer: links|Photo: left to right|Measured From Far Edge|valid: no|no|x|?"
    "|*|+|not ok|no signal|OK?|5|5.0|Operator 5|measured 5 by Anna|gauge 5.00|Messuhr 5,00|gauge -5|Caliper, 5 mm"
    "|Photo 5,00|Caliper 0-6 inch|Messschieber in Zoll|caliper on 150 mm block|Caliper: zero at 0.01 mm|1:10"
    "|45 %|Order: 3 2 1|foto 3 gemaakt. daarna andersom"
    "|Gemessen von der Tischplatte|Probe Rückseite|sample P02|P02|datum is the table"
    "|Seite 2|测量取消|Projekt 88, Probe 89|Regal 3, Probe P05|Regal 3, P05"
    "|测量人陈静：倒序|样品5号|Prüfer Meier: Umgedreht"
    "|Operator: Anna Meier, Werte in Fuß|Messschieber Mahr, Werte in Schritt|gestrichen: A. Meier"
    "|MEASURED BACKWARDS|Measured on Plate|Photo 3: 5|gemessen mit Messbrücke|10,2 zamiast 12,0|recorded order C, B, A"
    "|Lab 2 gauge, reads from Collar|zero not on face|zero at the caliper face|Nullpunkt auf der Probe|n.i.O."
    "|vylomené zrno na hraně - platí jen 1. hodnota|то же, что строкой выше|bolla d'aria sotto la punta -> scartare"
    "|ნიმუში შენახულია|عينة محفوظة|client: Devon roads; from here the other way round|记录：估计值"
)
"""A harmless label, instrument or empty word with more beside it; unknown words and scripts."""


@pytest.mark.parametrize("text", ["", "-", "/", "...", "(-)", *HARMLESS.split("|")])
def test_texts_of_known_words_are_harmless(text):
    assert is_harmless(text)


@pytest.mark.parametrize("text", CHANGING.split("|"))
def test_texts_that_name_a_change_are_asked(text):
    assert changes(text)
    assert not is_harmless(text)


LABELS = ("Operator: J. Smith, ", "12.05.2025 ", "Prüfer A. Meier; ", "Photo 12 - ")
HIDDEN = [label + text for label in LABELS for text in CHANGING.split("|")[::9]]


@pytest.mark.parametrize("text", [*UNKNOWN.split("|"), *BETWEEN.split("|"), *HIDDEN])
def test_texts_that_are_not_known_as_a_whole_are_asked(text):
    assert not is_harmless(text)


SHEETS = "Sheet1|Tabelle 1|May|P01 Messung|Feuil1|Hoja1|Blad1|Лист1|工作表1|P01|Q12 (2)|2025-05-12"
SHEETS_WITH_A_CHANGE = 'P01 inch|in inch|P01 in|P01 [in]|P01 left|P01 links|P01 nass|P01 repeat|P01 1/10|P01 +5|P01 5"'


def test_time_does_not_explode_with_the_length():
    """A cell has up to 32,767 letters. Alternatives that match the same word would take 2^n steps."""
    begin = time.process_time()
    for text in ("da " * 130 + "x", "1" * 400, "1" * 32_000, "1, " * 130, "ß" * 399):
        assert not is_harmless(text)
    assert time.process_time() - begin < 2


@pytest.mark.parametrize(("names", "change"), [(SHEETS, False), (SHEETS_WITH_A_CHANGE, True)])
def test_names_of_sheets_and_files_may_name_a_change(names, change):
    assert [name for name in names.split("|") if changes(name) is not change] == []


def test_only_the_name_of_the_sample_itself_is_harmless():
    assert all(is_harmless(text, "P01") for text in ("P01", "p 01", "Sample P01, stored in cabinet 4"))
    others = ("P01'", "sample P01* measured by J. Smith", "P02", "P011")
    assert not any(is_harmless(text, "P01") for text in others)
