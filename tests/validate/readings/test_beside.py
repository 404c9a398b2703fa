"""Texts beside the numbers, in 16 languages: harmless, or part of a question."""

# ruff: noqa: RUF001  Texts of labs have letters of all scripts.

import time

import pytest

from validate.readings.beside import changes, is_harmless

HARMLESS = (
    "Measured by J. Smith on 12 May 2025|no remarks|signed: M. Jones|thanks to Peter for the help|"
    "Keine Auffälligkeiten|Seite 2 von 3|Tel. 0221 470 1234|Rien à signaler|"
    "Client : Ville de Lyon, dossier 2025/33|Medido por M. Fernández el 3 de marzo de 2025|"
    "Temperatura del laboratorio 23 °C|misurato da L. Bianchi il 5 maggio 2025|"
    "Cliente: Comune di Torino, commessa 889|sem observações|"
    "Gemeten door P. de Vries op 14-03-2025|Opdrachtgever: Gemeente Utrecht|"
    "Zdjęcie nr 15 zrobione w laboratorium|Měřil: Petr Novák|teplota v místnosti 22 °C|"
    "Kuva 14 otettu laboratoriossa|Provet förvaras i skåp 3|Numune 3 numaralı dolapta saklanıyor|"
    "Mérte: Nagy Péter|测量人：王伟|測定者：田中|Измерил: Иванов И.И.|температура в помещении 21 °C|"
    "Invoice sent to customer on Friday|gez. Lehmann|photo dans le dossier du projet|"
    "Medições feitas por Pedro Almeida|kawa o 10:30|aurinkoinen sää|hava güneşli|測定は佐藤が行った|"
    "kontrollerad av B. Lind 2025-05-12|Contact: Mark Hill, phone 0113 496 0000|"
    "Fotos siehe Ordner 12|Responsable: Ana Torres|Operatrice: Chiara Greco|Datum: 4 juni 2025|"
    "Laborant: Tomáš Černý|Operatör: Lisa Berg|Laboratuvar 2, raf 3|操作员：张伟，湿度50%|"
    "It was raining all day|Messschieber HOLEX digital 412811, Kal. bis 08/2026|"
    "Pie de rey Mitutoyo, nº 33812|umidità 50 %|Sprawozdanie nr 15/2025|"
    "Provet levererat av kunden|Протокол № 15/2025|No comments|Probe lagert in Kiste 7|"
    "Mesuré par Claire Dubois, 12/05/2025|Muestra almacenada en la estantería 6|Calibro n. 228|"
    "Céu nublado|Zmierzyła Ewa Wójcik, 12.05.2025|Näyte on hyllyssä 5|"
    "Mérte: Kiss Éva, 2025.05.12.|Измерила Смирнова Е.В., 12.05.2025|Humidity was 47 %|"
    "Signature: P. Hall|Probe wurde am 2. Juni 2025 geliefert|Page 1 sur 2|"
    "Guardada a temperatura ambiente|pioggia al mattino|handtekening P. Groen|kuvat kansiossa 12|"
    "技术员：刘洋"
)
CHANGING = (
    "all values in inches|5 mm spacer under the foot|Operator: values in inch|"
    "please subtract the plate thickness|readings doubled by mistake|"
    "Remark: all from the right end|not sure about this one|Nullpunkt auf 5-mm-Endmaß|"
    "Messung wiederholt, erste verworfen|Tiefenmaß 3 mm zu lang|nach 24 h Aushärtung|"
    "gemessen mit Abstandshalter|mesuré depuis l'extrémité droite|diviser par 10|signe inversé|"
    "valores en pulgadas|restar 5 mm|otra probeta|spessore di 5 mm sotto il piede|zero sul fondo|"
    "calço de 5 mm por baixo do pé|amostra ainda úmida|gemeten vanaf het rechter uiteinde|"
    "monster nog nat|mierzone od prawego końca|znak odwrócony|podložka 5 mm pod patkou|"
    "arvot tuumina|5 mm välikappale jalan alla|ogiltig, mät om|sağ uçtan ölçüldü|"
    "a jobb végtől mérve|数值单位为英寸|脚下垫了5毫米垫块|単位はインチ|10で割る|измерено от правого конца|"
    "The tape started at the far side of the sample.|Value read off wrong scale|"
    "Messung von Anna Meier, Skala in Zoll|Ablesung unsicher wegen Spiegelung|lecture à ignorer|"
    "Misurato da Carla, valori in cm|Gemeten door Piet, schaal in inch|"
    "Zmierzył Jan, wartości w cm|Tento údaj neplatí|Mittarin alla oli 2 mm levy|"
    "Ahmet ölçtü, santimetre olarak|Péter mérte, centiméterben|此读数不可靠|この読みは疑わしい|"
    "Под штангенциркулем пластина 2 мм|Operator J.K., scale was turned|"
    "Numbers are half a turn of the screw each|Ort gezählt vom Ende|"
    "Date : 3 juillet, valeurs en cm|Responsable: Ana, todo en cm|lectura con galga de 3 mm|"
    "origine a destra|amostra invertida|begin rechts|początek z prawej|alku oikealla|"
    "början till höger|László: minden cm-ben|测量取消|鈴木：全部センチ|Сидорова: всё в см|Batch B, not A|"
    "Every second station left out|Werte mal zwei nehmen|il segno è opposto|数值加倍|"
    "Sample kept on its side while measured|Room 21, zero on ledge|Bediener Wolf: ab Zeile 5 Zoll|"
    "gezeichnet von hinten nach vorne|Observación: en pulgadas|Calibro con spessore di 2 mm|"
    "Uwaga: w calach|Huom: tuumina|Skjutmått på 2 mm kloss|Tolómérő 2 mm alátéttel|卡尺垫2毫米|"
    "ノギスに2mmの板|Operator changed, new zero|Order from far to near|"
    "The customer defines up as positive|Mitutoyo caliper, jaws worn 0.1 mm|Werte um 2 zu hoch|"
    "Technicienne Julie : cotes inversées|avec cale|de abajo arriba|dal basso verso l'alto|"
    "de baixo para cima|Laborantka Ola: w cm|Laborant Maja: cm|技术员刘洋：厘米"
)
"""Texts with a word that may change readings."""
UNKNOWN = (
    "gauge reads 5.00 when flush with the face|muestra todavía húmeda|leitura duvidosa|"
    "hodnoty v palcích|etumerkki käännetty|geçersiz|osztani 10-zel|образец ещё влажный|"
    "Hier hat sich der Messschieber verklemmt|Il tastatore è scivolato|"
    "Mittasi Matti, arvot senttimetreinä|Caliper: Starrett, but in sixteenths|"
    "Bearbeiter: T. Hoffmann, Werte in Fuß|compter à partir du fond|monster omgedraaid|"
    "začátek vpravo|ölçüm iptal|サンプルを裏返した|Measured by T. Evans against the fixture|"
    "Regal C, Probe Rückseite|hauteur mesurée avec la plaque|valores redondeados a enteros|"
    "medido pelo técnico do lado da janela|gemeten vanaf de deur|wartości podwojone|"
    "hodnoty zdvojnásobit|arvot kaksinkertaisia|pencereden itibaren ölçüldü|az értékek duplázva|"
    "窓側から測定|высота от стола|Mesuré par Claire à l'envers|Gemeten door Eva, achterstevoren|"
    "Poznámka: v palcích|Mérte Éva, visszafelé|Photos show row 4 in error|"
    "Each value is the total of two|Zeilen 4-6 streichen|con calzo|met vulplaatje|s podložkou|"
    "4-6. sor törlendő"
)
"""Texts that change readings by words of no list."""
BETWEEN = (
    "Operator: values in inch|Operator: Zoll|Prüfer: links|Photo: left to right|Measured From Far Edge|valid: no|no|x|?"
    "|*|+|not ok|no signal|OK?|5|5.0|Operator 5|measured 5 by Anna|gauge 5.00|Messuhr 5,00|gauge -5|Caliper, 5 mm"
    "|Photo 5,00|Caliper 0-6 inch|Messschieber in Zoll|caliper on 150 mm block|Caliper: zero at 0.01 mm|1:10|45 %|Order: 3 2 1"
    "|Gemessen von der Tischplatte|Probe Rückseite|sample P02|P02|Mitutoyo|Anna Meier|datum is the table"
    "|Seite 2|测量取消|Projekt 88, Probe 89|Regal 3, Probe P05|Regal 3, P05"
    "|测量人陈静：倒序|样品5号|Prüfer Meier: Umgedreht"
    "|ნიმუში შენახულია|عينة محفوظة|시료 보관"
)
"""A harmless label, instrument or empty word with more beside it; unknown words and scripts."""


@pytest.mark.parametrize("text", ["", "-", "/", "...", "(-)", *HARMLESS.split("|")])
def test_texts_of_known_words_are_harmless(text):
    assert is_harmless(text)


@pytest.mark.parametrize("text", CHANGING.split("|"))
def test_texts_that_name_a_change_are_asked(text):
    assert changes(text)
    assert not is_harmless(text)


@pytest.mark.parametrize("text", [*UNKNOWN.split("|"), *BETWEEN.split("|")])
def test_texts_that_are_not_known_as_a_whole_are_asked(text):
    assert not is_harmless(text)


@pytest.mark.parametrize("text", CHANGING.split("|")[::3])
@pytest.mark.parametrize("label", ["Operator: J. Smith, ", "12.05.2025 ", "Prüfer A. Meier; ", "Photo 12 - "])
def test_a_harmless_beginning_does_not_hide_the_rest(label, text):
    assert not is_harmless(label + text)


@pytest.mark.parametrize(
    ("text", "harmless"),
    [
        ("P01", True),
        ("p 01", True),
        ("Sample P01, stored in cabinet 4", True),
        ("P01'", False),
        ("sample P01* measured by J. Smith", False),
        ("P02", False),
        ("P011", False),
    ],
)
def test_only_the_name_of_the_sample_itself_is_harmless(text, harmless):
    assert is_harmless(text, "P01") is harmless


SHEETS = "Sheet1|Tabelle 1|May|P01 Messung|Feuil1|Hoja1|Blad1|Лист1|工作表1|P01|Q12 (2)|2025-05-12"
SHEETS_WITH_A_CHANGE = 'P01 inch|in inch|P01 in|P01 [in]|P01 left|P01 links|P01 nass|P01 repeat|P01 1/10|P01 +5|P01 5"'


def test_time_does_not_explode_with_the_length():
    """A cell has up to 32,767 letters. Alternatives that match the same word would take 2^n steps."""
    begin = time.process_time()
    for text in ("da " * 130 + "x", "1" * 400, "1" * 32_000, "Datum " + "1. " * 130, "ß" * 399):
        assert not is_harmless(text)
    assert time.process_time() - begin < 2


@pytest.mark.parametrize("name", SHEETS.split("|"))
def test_usual_names_of_sheets_and_files_change_nothing(name):
    assert not changes(name)


@pytest.mark.parametrize("name", SHEETS_WITH_A_CHANGE.split("|"))
def test_names_of_sheets_and_files_may_name_a_change(name):
    assert changes(name)
