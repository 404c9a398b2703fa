"""Texts beside the numbers, in 16 languages: harmless, or part of a question."""

# ruff: noqa: RUF001  Texts of labs have letters of all scripts.

import pytest

from validate.readings.beside import changes, is_harmless

HARMLESS = (
    "Measured by J. Smith on 12 May 2025|Digital caliper Mitutoyo 500-196-30, S/N 1234, 150 mm|none|"
    "Photo IMG_2041.jpg taken at 10:15|room temperature 21.5 °C, humidity 48 %|signed: M. Jones|"
    "Lab notebook 3, page 17|Delivered by courier on Monday|thanks to Peter for the help|"
    "Gemessen von Hanna Schulz, 03.04.2025|Bemerkungen: keine|Raumtemperatur 22 °C, Luftfeuchte 45 %|"
    "Auftrag 4711, Auftraggeber Stadt Köln|Seite 2 von 3|Probe am Montag angeliefert|"
    "Messuhr Käfer, Messbereich 0-10 mm, Auflösung 0,01 mm|Labor 2.14, Herr Becker|"
    "mesuré par C. Martin le 4 juin 2025|Rien à signaler|Photo n° 45 prise par le technicien|"
    "pied à coulisse Facom n° 8812|météo : ensoleillé|Rapport signé le 12/06/2025|Operador: Luis García|"
    "sin observaciones|Cliente: Ayuntamiento de Sevilla|Temperatura del laboratorio 23 °C|Firmado: P. Ruiz|"
    "Operatore: Marco Rossi|nessuna osservazione|foto scattata in laboratorio|"
    "Cliente: Comune di Torino, commessa 889|pagina 4|Medido por A. Costa em 10/02/2025|"
    "Amostra guardada na prateleira 3|Cliente: Câmara Municipal de Lisboa|Gemeten door P. de Vries op 14-03-2025|"
    "Monster bewaard in kast 2|schuifmaat Mitutoyo, serienummer 88213|temperatuur in het lab 20 °C|brak uwag|"
    "Zdjęcie nr 15 zrobione w laboratorium|Zleceniodawca: Miasto Kraków|Data pomiaru: 12.05.2025|bez poznámek|"
    "Fotografie č. 8 pořízena v laboratoři|teplota v místnosti 22 °C|Mittaaja: Matti Virtanen|"
    "Näyte säilytetään kaapissa 2|työntömitta Mitutoyo, sarjanumero 4412|Uppmätt av K. Larsson|"
    "Provet förvaras i skåp 3|skjutmått nr 77|Ölçen: A. Yılmaz|fotoğraf laboratuvarda çekildi|not yok|"
    "Mérte: Nagy Péter|A minta a 3-as szekrényben van|tolómérő, gyári szám 8812|测量人：王伟|无|照片在实验室拍摄|特になし|写真は実験室で撮影|"
    "Измерил: Иванов И.И.|Образец хранится в шкафу 4|штангенциркуль № 3321|Дата: 12.05.2025|"
    "Photo folder: 2025/June/Ring Road|Invoice sent to customer on Friday|"
    'Die Messung wurde von Herrn Schneider durchgeführt.|Protokoll liegt im Ordner "Fugen 2025"|'
    "Messmittel: Tiefenmessschieber Holex, Nr. 771|L'échantillon vient de la route D 906|"
    "photo dans le dossier du projet|Realizado por: Carmen Ortega, técnico de laboratorio|"
    "Le misure sono state eseguite da Giulia Conti|Sala 12, edifício B|Pomiary wykonała Anna Wiśniewska|"
    "kawa o 10:30|Měření provedla Jana Dvořáková|slunečné počasí|Näyte on otettu tieltä 4|"
    "Mätningarna gjordes av Erik Svensson|soligt väder, 18 °C|Numune E-5 karayolundan alındı|"
    "A méréseket Kovács Anna végezte|napos idő|样品取自G2高速公路|測定は佐藤が行った|Образец взят с трассы М7|"
    "Protokół podpisał kierownik laboratorium|Operator J.K., Tuesday afternoon|"
    "Caliper: Starrett 799, serial 20-14558|Humidity 55 %, room 21 C|drawing no. 44-B|"
    "Datum: 17.06.2025, Uhrzeit 9:45|Kunde: Autobahn GmbH|Date : 3 juillet 2025|Laboratoire de Nantes, salle B12|"
    "Merci à toute l'équipe|Ensayo realizado en el laboratorio de Madrid|Humedad 60 %|Operatrice: Chiara Greco|"
    "Tempo piovoso|tempo chuvoso|Datum: 4 juni 2025|lade 3, kast B|Pogoda: deszcz|Datum měření 5. 6. 2025|"
    "Laboratorio, huone 12|Operatör: Lisa Berg|Datum: 2025-06-04|Operatör: Ayşe Kaya|Dátum: 2025.06.04.|"
    "Fotó: Szabó László|操作员：张伟，湿度50%|担当：鈴木|Measured by hand caliper, Mitutoyo, by T. Evans|"
    "Sample label printed by the office|Messung durch Frau Krüger, 14:20 Uhr|"
    "Messschieber HOLEX digital 412811, Kal. bis 08/2026|Luftfeuchtigkeit 52 %|humidité 45 %|"
    "Responsable del ensayo: J. Romero|Giornata piovosa|umidità 50 %|Técnico: Miguel Sousa|Projectnummer 25-0331|"
    "Badanie wykonał: M. Lis|Näyte toimitettu 3.6.2025|Provet levererat av kunden|报告编号：2025-15|報告書番号 2025-15|"
    "На улице дождь"
)
CHANGING = (
    "all values in inches|multiply by 10|rows 4 to 6 rejected, see repeat below|Operator: values in inch|"
    "checked: zero is on a 5 mm block|sample was still wet|readings doubled by mistake|do not use|add 1.5 to each|"
    "not sure about this one|Einheit: Zoll|von rechts gemessen|Messung wiederholt, erste verworfen|"
    "Prüfer: alles in cm|Vorzeichen umgekehrt|nach 24 h Aushärtung|gegenüber der Tischplatte gemessen|"
    "Fuß stand auf der Schiene|mesuré depuis l'extrémité droite|cale de 5 mm sous le pied|"
    "le zéro est au fond de la fissure|signe inversé|lectures prises de droite à gauche|"
    "medido desde el extremo derecho|restar 5 mm|multiplicar por diez|valori in pollici|"
    "spessore di 5 mm sotto il piede|segno invertito|valores em polegadas|calço de 5 mm por baixo do pé|"
    "sinal trocado|zero na mesa|gemeten vanaf het rechter uiteinde|afstandhouder van 5 mm onder de voet|"
    "nulpunt op de tafel|mierzone od prawego końca|próbka jeszcze mokra|měřeno od pravého konce|"
    "podložka 5 mm pod patkou|nula je na stole|mitattu oikeasta päästä|5 mm välikappale jalan alla|"
    "mätt från höger ände|5 mm distans under foten|sağ uçtan ölçüldü|10'a bölünecek|5 mm alátét a talp alatt|"
    "数值单位为英寸|作废|除以10|単位はインチ|足の下に5mmのスペーサー|符号が逆|измерено от правого конца|знак обратный|All numbers are thou.|"
    "Value read off wrong scale|Anna: please halve all readings|Prüfer K. Vogel: Tiefe plus 2|"
    "Ablesung unsicher wegen Spiegelung|Les chiffres sont des dixièmes|Medido por Luis, en centímetros|"
    "Misurato da Carla, valori in cm|Este ponto foi anulado|Er lag een plaatje van 2 mm onder|"
    "Zmierzył Jan, wartości w cm|Měřil Petr, v centimetrech|Pod měřidlem byl plech 2 mm|Mittarin alla oli 2 mm levy|"
    "Plåt 2 mm under mätaren|Bu okuma hatalı|Péter mérte, centiméterben|王伟测量，单位厘米|卡尺下面有2毫米垫片|この読みは疑わしい|"
    "Измерил Петров, в сантиметрах|Sample: turned around|Operator J.K., scale was turned|"
    "The sample was flipped before this row|Not measured, estimated|Ort gezählt vom Ende|ab hier Zentimeter|"
    "Photo : de droite à gauche|Responsable: Ana, todo en cm|Fotografía: origen a la derecha|"
    "Operatrice Chiara: misure in decimi|origine a destra|ensaio anulado|origem à direita|begin rechts|"
    "pomiar anulowany|Laborant Tomáš: vše v cm|alku oikealla|mätningen gäller inte|Ayşe: hepsi cm|"
    "László: minden cm-ben|操作员张伟：全部厘米|样品翻转|鈴木：全部センチ|始点は右|начало справа|Batch B, not A|Levels above datum pin|"
    "From Groove Centre Outwards|Werte mal zwei nehmen|hay que cambiar el signo|waarden halveren|数值加倍"
)
"""Texts with a word that may change readings."""
UNKNOWN = (
    "gauge reads 5.00 when flush with the face|this one belongs to P02|muestra todavía húmeda|da ripetere|"
    "leitura duvidosa|pomiar nieważny|hodnoty v palcích|jaa kymmenellä|etumerkki käännetty|provet fortfarande vått|"
    "geçersiz|az értékek hüvelykben|osztani 10-zel|недействительно, повторить|образец ещё влажный|"
    "Photo 3: the first reading is from the neighbouring crack|Hier hat sich der Messschieber verklemmt|"
    "Las lecturas van del final al principio|Il tastatore è scivolato|Medido por Rui com a peça virada|"
    "Mittasi Matti, arvot senttimetreinä|Ez a leolvasás bizonytalan|Caliper: Starrett, but in sixteenths|"
    "Levels relative to the bench|Bearbeiter: T. Hoffmann, Werte in Fuß|Probe lag auf dem Kopf|"
    "compter à partir du fond|campione capovolto|monster omgedraaid|měření zrušeno|začátek vpravo|näyte käännetty|"
    "ölçüm iptal|mérés törölve|サンプルを裏返した|образец перевёрнут|Measured by T. Evans against the fixture|"
    "Messung durch Frau Krüger ab Rissende|Regal C, Probe Rückseite|gemessen mit aufgesetztem Lineal|"
    "hauteur mesurée avec la plaque|les deux premières lignes sont fausses|valores redondeados a enteros|"
    "le quote sono riferite al banco|medido pelo técnico do lado da janela|cota em relação à bancada|"
    "gemeten vanaf de deur|hoogte ten opzichte van de bank|wartości podwojone|wysokość względem stołu|"
    "hodnoty zdvojnásobit|výška vůči stolu|arvot kaksinkertaisia|mätt från fönstret|pencereden itibaren ölçüldü|"
    "masadan yükseklik|az értékek duplázva|从窗户开始测量|窓側から測定|измерено от окна|высота от стола"
)
"""Texts that change readings by words of no list."""
BETWEEN = (
    "Operator: values in inch|Operator: Zoll|Prüfer: links|Photo: left to right|Measured From Far Edge|valid: no|no|x|?|*|+"
    "|not ok|no signal|OK?|5|5.0|Operator 5|measured 5 by Anna|gauge 5.00|Messuhr 5,00|gauge -5|Caliper, 5 mm|Photo 5,00"
    "|Caliper 0-6 inch|Messschieber in Zoll|caliper on 150 mm block|Caliper: zero at 0.01 mm|1:10|45 %|Order: 3 2 1"
    "|Gemessen von der Tischplatte|Probe Rückseite|sample P02|P02|Mitutoyo|Anna Meier|datum is the table|Seite 2|测量取消"
    "|ნიმუში შენახულია|عينة محفوظة|시료 보관"
)
"""A harmless label, instrument or empty word with more beside it; unknown words, and scripts of which no word is known."""


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


@pytest.mark.parametrize("name", SHEETS.split("|"))
def test_usual_names_of_sheets_and_files_change_nothing(name):
    assert not changes(name)


@pytest.mark.parametrize("name", SHEETS_WITH_A_CHANGE.split("|"))
def test_names_of_sheets_and_files_may_name_a_change(name):
    assert changes(name)
