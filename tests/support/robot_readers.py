"""Small readers of robots' languages, written from their references and not from our writers; unknown words raise."""

import ast
import re
from dataclasses import dataclass, field

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Motion:
    """One move of the tip, mm and mm/s, and what the dispenser does during it."""

    place: Place
    speed: float
    given: float = 0.0
    """G-code: of the extruder; SPEL+: coordinate of the added axis; URScript: level of the output."""
    how: str = ""
    blend: float = 0.0


def read_gcode(text: str) -> list[Motion]:
    """RS274/NGC with Marlin's extruder: modal, F in mm/min, ``;`` to the line's end a comment."""
    place, feed, e = {"X": 0.0, "Y": 0.0, "Z": 0.0}, 0.0, 0.0
    metric = absolute = absolute_e = False
    motions = []
    for line in text.splitlines():
        code = line.split(";", 1)[0].strip()
        if not code:
            continue
        words = [re.fullmatch(r"([A-Z])(-?\d+(?:\.\d+)?)", word) for word in code.split()]
        assert all(words), f"no word of G-code in {line!r}"
        letters = {word[1]: float(word[2]) for word in words if word}
        head = code.split()[0]
        if head == "G21":
            metric = True
        elif head == "G90":
            absolute = True
        elif head in ("M82", "M83"):
            absolute_e = head == "M82"
        elif head == "G92":
            assert set(letters) == {"G", "E"}
            e = letters["E"]
        elif head == "M302":
            assert letters == {"M": 302, "P": 1}
        elif head in ("G0", "G1"):
            assert metric, "a move before the unit is set"
            assert absolute
            assert set(letters) <= {"G", "X", "Y", "Z", "E", "F"}
            place |= {axis: letters[axis] for axis in "XYZ" if axis in letters}
            feed = letters.get("F", feed)
            before = e
            if "E" in letters:
                e = letters["E"] if absolute_e else e + letters["E"]
            motions.append(Motion((place["X"], place["Y"], place["Z"]), feed / 60, e - before, head))
        else:
            raise AssertionError(f"unknown command in {line!r}")
    return motions


NUMBER = r"(-?\d+(?:\.\d+)?)"
POINT = re.compile(rf"P(\d+) = XY\(([^)]*)\)(?: :ST\({NUMBER}, {NUMBER}\))?( /[RL])?( /\d+)?")


@dataclass
class Spel:
    """A SPEL+ function as it would run."""

    points: dict[int, tuple[float, ...]] = field(default_factory=dict)
    """All coordinates of XY, and S and T where they are given."""
    flags: set[str] = field(default_factory=set)
    motions: list[Motion] = field(default_factory=list)
    switches: list[tuple[int, str]] = field(default_factory=list)
    """Motions before it, and "On 8" or "Off 8"."""
    curve: tuple[int, int, int] | None = None
    """Axes, first and last point."""


def read_spel(text: str) -> Spel:
    """A ``'`` begins a comment; statements of the SPEL+ Language Reference, one a line."""
    program, speed, inside = Spel(), 0.0, False
    for line in text.splitlines():
        code = line.split("'", 1)[0].strip()
        if not code:
            continue
        if code == "Function sealtwin":
            assert not inside
            inside = True
        elif code == "Fend":
            inside = False
        elif point := POINT.fullmatch(code):
            assert inside
            added = tuple(float(value) for value in point.groups()[2:4] if value is not None)
            program.points[int(point[1])] = (*(float(value) for value in point[2].split(",")), *added)
            program.flags |= {flag.strip() for flag in point.groups()[4:] if flag}
        elif match := re.fullmatch(rf"SpeedS {NUMBER}", code):
            speed = float(match[1])
            assert speed >= 0.1
        elif re.fullmatch(rf"AccelS {NUMBER}|Tool \d+", code):
            assert inside
        elif match := re.fullmatch(r"(On|Off) \d+", code):
            program.switches.append((len(program.motions), code))
        elif match := re.fullmatch(r"Move P(\d+)( CP)?", code):
            place = program.points[int(match[1])]
            program.motions.append(_spel_motion(place, speed, f"Move{match[2] or ''}"))
        elif match := re.fullmatch(r'Curve "(\w+)", O, 0, (\d), P\((\d+):(\d+)\)', code):
            program.curve = int(match[2]), int(match[3]), int(match[4])
        elif match := re.fullmatch(r'CVMove "(\w+)"( CP)?', code):
            assert program.curve is not None
            _, first, last = program.curve
            assert 3 <= last - first + 1 <= 200
            # A spline starts where the arm stands.
            assert program.motions[-1].place == program.points[first][:3]
            for number in range(first + 1, last + 1):
                program.motions.append(_spel_motion(program.points[number], speed, "CVMove"))
        else:
            raise AssertionError(f"unknown statement {line!r}")
    assert not inside
    return program


def _spel_motion(place: tuple[float, ...], speed: float, how: str) -> Motion:
    x, y, z = place[:3]
    return Motion((x, y, z), speed, place[-2] + place[-1], how)


@dataclass
class Script:
    """A URScript function as it would run; metres turned into millimetres."""

    motions: list[Motion] = field(default_factory=list)
    rotations: set[tuple[float, ...]] = field(default_factory=set)
    accelerations: set[float] = field(default_factory=set)
    outputs: set[tuple[str, int]] = field(default_factory=set)
    level_at_end: float = 0.0


def read_urscript(text: str) -> Script:
    """``#`` begins a comment; a function from ``def name():`` to ``end``; calls with named arguments."""
    script, level, inside = Script(), 0.0, False
    for line in text.splitlines():
        code = line.split("#", 1)[0].strip()
        if not code:
            continue
        if code == "def sealtwin():":
            assert not inside
            inside = True
            continue
        if code == "end":
            inside = False
            continue
        assert inside, f"code outside the function: {line!r}"
        call = ast.parse(code.replace("p[", "["), mode="eval").body
        assert isinstance(call, ast.Call), line
        assert isinstance(call.func, ast.Name), line
        values = [ast.literal_eval(argument) for argument in call.args]
        named = {str(keyword.arg): ast.literal_eval(keyword.value) for keyword in call.keywords}
        if call.func.id in ("set_standard_analog_out", "set_standard_digital_out"):
            port, value = values
            level = float(value)
            assert 0 <= level <= 1
            script.outputs.add((call.func.id, port))
        elif call.func.id in ("movej", "movel", "movep"):
            ((x, y, z, *rotation),) = values
            script.rotations.add(tuple(rotation))
            assert set(named) <= {"a", "v", "r"}
            speed, blend = 1000 * named["v"], 1000 * named.get("r", 0.0)
            script.motions.append(Motion((1000 * x, 1000 * y, 1000 * z), speed, level, call.func.id, blend))
            script.accelerations |= {1000 * named["a"]} if call.func.id != "movej" else set()
        else:
            raise AssertionError(f"unknown function in {line!r}")
    assert not inside
    script.level_at_end = level
    return script


READERS = {"gcode": read_gcode, "spel": read_spel, "urscript": read_urscript}
"""Reader of each language; the other formats are tables without comments."""
