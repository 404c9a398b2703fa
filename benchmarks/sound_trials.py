"""Twenty sound trials, in which nothing is wrong, through each door: cautions, questions and refusals are counted.

    python -m benchmarks.sound_trials [--only TRIAL]...

A caution is a doubt, a caution or a fault that a door prints, shows on its page or gives as a Python warning; what it
says that it assumed is none. A question is what 'ingest' writes into pairing.csv, or a refusal that asks for an answer.
A refusal is an exit code other than 0 and 5, or an InputError. No count may rise above ``TODAY``.
"""

import json
import re
import tempfile
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import tomlkit

import sealtwin as st
from benchmarks.table import Row, one_of, run_benchmark
from digitise.trace_page.session import Shape
from fixtures.generate.sound_trials import SOUND, Given, filled, given, lab_folder, write_toml
from sealtwin.api.samples import HintKeywords, ScaleKeywords
from sealtwin.core.errors import InputError
from sealtwin.core.files import write_bytes
from sealtwin.trial.trace_photo import opened
from sealtwin.trial.trial_file import with_settings
from tests.support.processes import sealtwin

LAB, ACCEPTED = "lab", (0, 5)
NAMES = (*SOUND, LAB)
NOTE = re.compile(r"^(?:note|warning|fault): (?!Assumed)(.+)", re.MULTILINE)  # What was assumed is counted nowhere
EVERYDAY = {"readings.file": "--caliper", "mesh.units": "--units"}  # Settings with an option of their own that is used
WRITTEN_ANEW = ("photo", "crack", "path", "fluid")
ASKS = re.compile(r"\?|Give readings\.")
WHICH = re.compile("which line is the crack|may be the crack")


class Reaction(NamedTuple):
    """What a door says of a trial: the key of each caution by its sentence, questions, and refusals."""

    cautions: dict[str, str]
    questions: list[str]
    refusals: list[str]

    @property
    def counts(self) -> tuple[int, int, int]:
        return len(self.cautions), len(self.questions), len(self.refusals)

    @property
    def keys(self) -> tuple[list[str], list[str], list[str]]:
        """The key of each caution, and the first words of each question and refusal."""
        return [*self.cautions.values()], [*map(first_words, self.questions)], [*map(first_words, self.refusals)]


Door = Callable[[Given, Path], Reaction]


def quick(one: Given, folder: Path) -> Reaction:
    return commanded("quick", one.shown, *options(one, folder), out=folder / "quick")


def run(one: Given, folder: Path) -> Reaction:
    """Run the trial of 'sealtwin init' after its settings were replaced."""
    file = folder / "trial" / "trial.toml"
    sealtwin("init", file.parent)
    # Whoever has another scale, paste, path or a mesh writes that table anew.
    rest = {key: value for key, value in tomllib.loads(file.read_text()).items() if key not in WRITTEN_ANEW}
    write_toml(file, one.settings | {f"{one.kind}.file": one.shown}, rest)
    return commanded("run", file, out=folder / "run")


def digitise(one: Given, folder: Path) -> Reaction:
    return commanded("digitise", one.shown, *options(one, folder, one.kind, "crack", "path"), out=folder / "sample")


def trace(one: Given, _: Path) -> Reaction:
    """Trace a photo on the page as far as its walls, and save its trial."""
    page = opened(one.shown, one.of("photo", "crack"))
    hints = page.session.hints
    answers = [*page.session.trace(hints, 1, "walls")]
    refused = [answer["refused"] for answer in answers if "refused" in answer]
    if not refused:
        page.save(hints, Shape())
    parts = [part for answer in answers for part in answer.values() if isinstance(part, dict)]
    cautions = {text: first_words(text) for part in parts for text in part.get("warnings", ())}
    asked = [text for text in refused if WHICH.search(text)]
    return Reaction(cautions, asked, [text for text in refused if text not in asked])


def ingest(one: Given, folder: Path) -> Reaction:
    """Take in a sample: its photo, its sheet or scan, and its settings in lab.toml."""
    home, settings = folder / "home", dict(one.settings)
    write_bytes(home / f"P01{one.shown.suffix}", one.shown.read_bytes())
    if (sheet := settings.pop("readings.file", None)) is not None:
        write_bytes(home / f"P01 Messung{sheet.suffix}", sheet.read_bytes())
    if (scan := settings.pop("readings.scan", None)) is not None:
        write_bytes(home / f"P01 scan{scan.suffix}", scan.read_bytes())
    write_toml(home / "lab.toml", settings)
    return commanded("ingest", home, out=folder / "lab")


def python(one: Given, _: Path) -> Reaction:
    tables, records, refused = with_settings({}, one.settings), list[Any](), list[str]()
    photo, readings = tables.get("photo", {}), tables["readings"]
    sheet = readings.pop("file", None) or readings.pop("scan")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            if one.kind == "mesh":
                solid = st.import_mesh(one.shown, **tables["mesh"])
                crack = solid.crack
            else:
                seen = st.read_photo(
                    one.shown, **{key: photo[key] for key in (*ScaleKeywords.__annotations__, "data") if key in photo}
                )
                crack, solid = (
                    st.trace_crack(
                        seen, **{key: photo[key] for key in ("ends_px", *HintKeywords.__annotations__) if key in photo}
                    ),
                    None,
                )
                records.append(seen)
            records.append(crack)
            filling = filled(crack, one.settings, solid)
            records += [filling.path.solid, filling.path, filling]
            taken = st.read_readings(sheet, filling.path.solid, **readings)
            st.compare(filling, taken, uncertainty=tables.get("uncertainty"))
        except InputError as fault:
            refused = f"{fault}".splitlines()
    texts = [str(warning.message) for warning in caught]
    texts += [f"{fact}" for record in records for fact in getattr(record, "warnings", ())]
    return refusal(refused) if refused else Reaction({text: first_words(text) for text in texts}, [], [])


OF_A_PHOTO: tuple[Door, ...] = (quick, run, digitise, trace, ingest, python)
OF_A_MESH: tuple[Door, ...] = (run, digitise, python)
TODAY = {
    "quick": (6, 0, 0),
    "run": (8, 0, 0),
    "digitise": (5, 0, 0),
    "trace": (2, 0, 0),
    "ingest": (5, 0, 0),
    "python": (3, 0, 0),
}
"""Cautions, questions and refusals of each door: all 29, 0, 0. 84e39147 had 167, 45, 44; acd3f9e9 60, 46, 43."""


def options(one: Given, folder: Path, *tables: str) -> Iterator[object]:
    """Yield the options of a command for settings of some tables, or for all."""
    for key, value in (one.of(*tables) if tables else one.settings).items():
        if key == "photo.markers":
            yield from ("--markers", write_toml(folder / "markers.toml", {key: value}))
        elif key in EVERYDAY:
            yield from (EVERYDAY[key], value)
        else:
            inline = tomlkit.inline_table()
            inline[key.rpartition(".")[2]] = f"{value}" if isinstance(value, Path) else value
            yield from ("--set", f"{key}={inline.as_string()[1:-1].partition(' = ')[2]}")


def commanded(*arguments: object, out: Path) -> Reaction:
    """Call a command, and return what it says, its page included."""
    answer = sealtwin(*arguments, "--out", out, "--json")
    content = json.loads(answer.stdout or "{}")
    if "error" in content or not content:
        return refusal((content.get("error") or repr(answer.exception)).splitlines())
    report = out / "report.json"
    shown = json.loads(report.read_text(encoding="utf-8")) if report.is_file() else {}
    facts = {fact["text"]: fact for fact in (*facts_in(content), *facts_in(shown))}
    cautions = {
        text: fact["key"] for text, fact in facts.items() if fact["kind"] == "doubt" or fact["level"] != "plain"
    }
    cautions |= {text: first_words(text) for text in NOTE.findall(answer.stderr) if text not in facts}
    # The samples of a lab. Facts about its traced photos are among those above.
    remarks = [text for sample in content.get("samples", ()) for text in sample["remarks"]]
    cautions |= {text: first_words(text) for text in remarks if not text.startswith("Assumed")}
    asked = [text for sample in content.get("samples", ()) for text in sample["faults"]]
    return Reaction(cautions, asked, [f"exit code {answer.exit_code}"] * (answer.exit_code not in ACCEPTED))


def refusal(lines: list[str]) -> Reaction:
    return Reaction({}, [line for line in lines if ASKS.search(line)], ["\n".join(lines)])


def facts_in(content: Any) -> Iterator[dict[str, Any]]:
    """Yield the facts in the content of a JSON file."""
    if isinstance(content, dict) and {"key", "text", "kind", "level"} <= content.keys():
        yield content
    elif isinstance(content, dict | list):
        for part in content.values() if isinstance(content, dict) else content:
            yield from facts_in(part)


def first_words(text: str) -> str:
    """Return the beginning of a sentence without the files before it and without numbers."""
    return " ".join(re.sub(r"[\d.,]+", "#", re.sub(r"^(\S+(\.\w+)?: )+", "", text)).split()[:6])


def reactions_of(names: Sequence[str]) -> dict[tuple[str, str], Reaction]:
    """Put trials through each door that takes them. Returns what was said, by trial and door."""
    reactions = dict[tuple[str, str], Reaction]()
    for name in names:
        with tempfile.TemporaryDirectory() as place:
            home = Path(place)
            if name == LAB:
                reactions[name, "ingest"] = commanded("ingest", lab_folder(home, home / "out"), out=home / "out")
                continue
            one = given(name, home / "given")
            for door in OF_A_MESH if one.kind == "mesh" else OF_A_PHOTO:
                reactions[name, door.__name__] = through(door, one, home)
    return reactions


def through(door: Door, one: Given, home: Path) -> Reaction:
    """Put a trial through a door. If it asks which line is the crack, answer and repeat: no caution stays hidden."""
    whole = Reaction({}, [], [])
    for number, trial in enumerate((one, one.answered)):
        folder = home / f"{door.__name__}-{number}"
        folder.mkdir()
        new = door(trial, folder)
        whole = Reaction(whole.cautions | new.cautions, whole.questions + new.questions, whole.refusals + new.refusals)
        if not any(WHICH.search(question) for question in new.questions):
            break
    return whole


def main(only: Annotated[list[str] | None, one_of(NAMES)] = None) -> list[Row]:
    reactions = reactions_of(only or NAMES)
    doors = [door.__name__ for door in OF_A_PHOTO]
    print("Cautions / questions / refusals")
    print(f"{'trial':<10}" + "".join(f"{door:>12}" for door in doors))
    for name in dict.fromkeys(name for name, _ in reactions):
        cells = [reactions.get((name, door)) for door in doors]
        print(f"{name:<10}" + "".join(f"{'/'.join(map(str, cell.counts)) if cell else '':>12}" for cell in cells))
    rows = list[Row]()
    for position, kind in enumerate(Reaction._fields):
        words = Counter((key, door) for (_, door), cell in reactions.items() for key in cell.keys[position])
        print(f"{kind}: {words.total()}")
        for key in sorted({key for key, _ in words}, key=lambda key: -sum(words[key, door] for door in doors)):
            print(f"  {key}: {', '.join(f'{door} {words[key, door]}' for door in doors if words[key, door])}")
        for door, most in TODAY.items():
            count = sum(cell.counts[position] for (_, by), cell in reactions.items() if by == door)
            rows.append(Row(f"{door}: {kind}", count, "", 0, most[position]))
    return rows


if __name__ == "__main__":
    run_benchmark(main)
