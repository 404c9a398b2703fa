"""Mutations: each returns a changed content, which follows from the content and the chance alone."""

import json
import random
import re
from copy import deepcopy
from typing import Any

import cv2
import numpy as np

ODD = (
    *("0", "-1", "1e300", "1e-300", "nan", "inf", "1_0", "0,1", "999999999999999999999", "0x10", '""', '"x"', "[]"),
    *("[[]]", "{}", "true", "[1, 2, 3]", '"../../notes.txt"', '"\\u202e"', "1979-05-27", '"cavity"', "[nan, 1]"),
)
"""Values in place of a sound one."""
ODD_JSON: tuple[Any, ...] = (
    *(None, True, -1, 0, -0.0, 1e308, 1e-320, float("nan"), float("inf"), 10**30, "", "x", "x" * 5000, "\ud800"),
    *("../../notes.txt", "/dev/null", [], {}, [[]], [1], {"a": 1}, [None, "x"]),
)
"""Values in place of a sound one in a JSON, which is read without a limit on its numbers."""


def flipped(content: bytes, chance: random.Random) -> bytes:
    """Change, cut, double or take out some bytes."""
    changed = bytearray(content)
    for _ in range(chance.choice((1, 1, 2, 5, 20))):
        at = chance.randrange(len(changed) or 1)
        match chance.randrange(5):
            case 0 | 1:
                changed[at : at + 1] = bytes([chance.randrange(256)])
            case 2:
                del changed[at : at + chance.choice((1, 4, 100))]
            case 3:
                changed[at:at] = changed[at : at + chance.choice((1, 4, 100))]
            case _:
                changed = changed[: chance.randrange(len(changed) + 1)] if chance.random() < 0.3 else changed
    return bytes(changed)


def reboxed(content: bytes, chance: random.Random) -> bytes:
    """Change, cut or double bytes in the boxes before the picture of an ISO media file, such as HEIC, or anywhere."""
    picture = content.index(b"mdat") if chance.random() < 0.7 else len(content)
    return flipped(content[:picture], chance) + content[picture:]


def reworded(content: bytes, chance: random.Random) -> bytes:
    """Change lines, values and words of a text; a quarter of the time bytes alone."""
    if chance.random() < 0.25:
        return flipped(content, chance)
    lines = content.decode("utf-8", "replace").splitlines()
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        at = chance.randrange(len(lines) or 1)
        line = lines[at] if lines else ""
        values = [*re.finditer(r"(?<==)\s*[^#\n]+|[-\d.]+|\"[^\"]*\"", line)]
        match chance.randrange(6):
            case 0 | 1 | 2 if values:
                value = chance.choice(values)
                lines[at] = f"{line[: value.start()]} {chance.choice(ODD)}{line[value.end() :]}"
            case 3:
                lines[at : at + 1] = []
            case 4:
                lines.insert(chance.randrange(len(lines) + 1), line)
            case _:
                letter = chance.randrange(len(line) + 1)
                lines[at : at + 1] = [
                    line[:letter] + chance.choice((*'x_ "]=;', "\t", "\ufeff", "\x00")) + line[letter:]
                ]
    return "\n".join(lines).encode()


def rekeyed(content: bytes, chance: random.Random) -> bytes:
    """Change values, types, keys and versions of a JSON; a tenth of the time its bytes, or all of it."""
    match chance.randrange(20):
        case 0:
            return flipped(content, chance)
        case 1:
            return chance.choice((b"", b"[]", b"null", b"{}", b"[" * 100_000, b'{"version": 1}', b"\xff\xfe"))
    tree = json.loads(content)
    for _ in range(chance.choice((1, 1, 2, 4))):
        places = _places(tree)
        if not places:
            break
        versions = [place for place in places if place[1] == "version"]
        above, key = chance.choice(versions if versions and chance.random() < 0.1 else places)
        other = chance.choice(places)
        match chance.randrange(8):
            case 0 | 1:
                del above[key]
            case 2:
                # A copy: a tree that contains itself is no JSON.
                above[key] = deepcopy(other[0][other[1]])
            case 3:
                above[key] = _other_type(above[key], chance)
            case 4 if isinstance(above, dict):
                above[chance.choice(("x", "", f"{key}x"))] = above.pop(key)
            case _:
                above[key] = deepcopy(chance.choice(ODD_JSON))
    return json.dumps(tree).encode()


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Return each list or dictionary with each of its keys; of a list the first two and the last."""
    if not isinstance(tree, dict | list):
        return []
    keys = [*tree] if isinstance(tree, dict) else sorted({0, 1, len(tree) - 1} & {*range(len(tree))})
    return [(tree, key) for key in keys] + [place for key in keys for place in _places(tree[key])]


def _other_type(value: Any, chance: random.Random) -> Any:
    """Return what a hurried hand would have written: text for a number, a list for its only value, a list cut short."""
    match value:
        case bool() | None:
            return chance.choice((int(bool(value)), str(value)))
        case int() | float():
            return chance.choice((str(value), [value], -value, value * 1e6, value / 1e6, value + 0.5))
        case str():
            return chance.choice(([value], len(value), {value: value}, value[:3], value.upper(), value * 30))
        case list():
            return chance.choice(
                (value[:-1], value + value[-1:], value[::-1], [value], dict(enumerate(value)), value[:1])
            )
        case _:
            return [*value.values()] if chance.random() < 0.5 else [value]


def repainted(content: bytes, chance: random.Random) -> bytes:
    """Change a picture: its size, depth, channels and places in it; a third of the time bytes alone."""
    if chance.random() < 0.33:
        return flipped(content, chance)
    decoded = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    picture = decoded.astype(float)
    height, width = picture.shape[:2]
    match chance.randrange(5):
        case 0:
            size = (chance.choice((1, 7, 100, 333, 1500)), chance.choice((1, 9, 100, 333, 1500)))
            picture = cv2.resize(picture, size)
        case 1:
            picture = picture * chance.choice((-1, 0, 0.1, 3)) + chance.choice((0, 40, 255))
        case 2:
            for _ in range(chance.choice((1, 5, 40))):
                corner, other = ((chance.randrange(width), chance.randrange(height)) for _ in range(2))
                picture = cv2.line(picture, corner, other, [chance.randrange(256)] * 3, chance.choice((1, 8, 30)))
        case 3:
            picture = np.roll(picture, chance.randrange(width), axis=chance.randrange(2))
        case _:
            picture += np.random.default_rng(chance.randrange(100)).normal(0, chance.choice((5, 50)), picture.shape)
    kind, channels = chance.choice((np.uint8, np.uint8, np.uint16)), chance.choice((1, 3, 4))
    picture = np.clip(picture, 0, 255).astype(kind) * (257 if kind is np.uint16 else 1)
    shown = picture[..., 0] if channels == 1 else np.dstack([picture, picture[..., :1]])[..., :channels]
    return cv2.imencode(chance.choice((".png", ".png", ".tif", ".webp" if kind is np.uint8 else ".png")), shown)[
        1
    ].tobytes()
