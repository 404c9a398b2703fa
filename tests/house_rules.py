"""Checks of ``make lint`` that no linter has.

Docstrings that are fragments, locals that do not say what they are, type names that are defined twice, and files that
are opened past the one reader.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence, Set
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("sealtwin", "digitise", "simulate", "validate")
BESIDE = ("tests", "benchmarks", "fixtures", "reports", "docs/_ext", "examples")
"""Folders of Python beside the packages, in which only the names of values are checked."""
FRAGMENT_OPENER = re.compile(
    r"(Above|And|As|At|Because|Before|Behind|Below|Beside|Between|Beyond|But|By|Else|For|From|How|In|Into|Nor|Of|On|Or|Over"
    r"|Since|So|Than|That|Then|Till|To|Under|Until|Up|What|When|Where|Whether|Which|Who|Whom|Whose|Why|With|Without)\b"
)
"""First words of docstrings that neither are a sentence with a verb nor name the thing."""
PARTICIPLES = frozenset({"found", "told", "said", "held", "known"})
"""Names that say how a value came about and not what it is: figures, sentences, runs."""
PRONOUNS = frozenset({"one", "at", "own", "given", "here", "how", "place", "each", "what", "there", "it"})
"""Names that point to a value and do not say what it is: index, velocity, position. Refused in the packages only."""
READER = "sealtwin/core/plain_files.py"
PAST_THE_READER = {
    READER: "is the reader",
    "sealtwin/core/files.py": "opens the files that it has written itself, to flush them",
    "sealtwin/__init__.py": "reads the packages' own files, before any of them is imported",
    "sealtwin/trial/starter_files.py": "reads files of the package",
    "validate/units.py": "reads a file of the package",
    "validate/readings/words.py": "reads a file of the package",
    "validate/report/write_report.py": "reads a file of the package",
    "digitise/trace_page/page.py": "reads files of the package; its sheets are photos that are decoded",
    "digitise/image/decoding.py": "asks for a plain file and its size itself, with words for photos",
    "digitise/drawing/read_dxf.py": "asks for a plain file and its size itself, with words for drawings",
    "sealtwin/scan/points_file.py": "hands NumPy, Pillow and trimesh what the reader has read",
    "simulate/watchers.py": "hands NumPy what the reader has opened",
    "sealtwin/study/study_map.py": "hands NumPy what the reader has opened",
    "sealtwin/cli/answer.py": "opens the null device",
    "sealtwin/cli/samples.py": "opens a browser",
}
"""Modules that may open files by themselves, and why."""
OPENS_A_PATH = re.compile(
    r"(^|\.)(open|fdopen)$|\.(read_text|read_bytes)$|^(np|numpy)\.(load|loadtxt|genfromtxt|fromfile|memmap)$"
    r"|^cv2\.(imread|VideoCapture)$|^(json|tomllib|pickle)\.load$|^(ElementTree|etree)\.parse$|^trimesh\.load(_mesh)?$|\.readfile$"
    r"|^shutil\.(copy|copyfile|copy2)$"
)
"""Calls that open a file by its path."""
READERS = re.compile(r"^(plain_)?files\.|^(read_bytes|read_text|opened)$")
"""Calls that go through the reader, or take what it has read."""


def modules(folders: Sequence[str] = PACKAGES) -> Iterator[tuple[Path, ast.Module]]:
    """Yield every module of some folders with its syntax tree."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def fragments(path: Path, tree: ast.Module) -> Iterator[str]:
    """Yield a line for each docstring, an attribute's included, whose first word opens a fragment."""
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))) if FRAGMENT_OPENER.match(text.lstrip()):
                yield f"{path}:{node.lineno}: the docstring is a fragment: {' '.join(text.split()[:8])} ..."


def vague_names(path: Path, tree: ast.Module, vague: Set[str] = PARTICIPLES | PRONOUNS) -> Iterator[str]:
    """Yield a line for each local or argument that is called by one of ``vague``; fields of files keep their names."""
    bodies = (node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    fields = {field.target for body in bodies for field in body if isinstance(field, ast.AnnAssign)}
    for node in ast.walk(tree):
        match node:
            case ast.Name(name, ast.Store()) | ast.arg(name) if name.strip("_") in vague and node not in fields:
                yield f"{path}:{node.lineno}: {name} is no name of a value: call it by its kind"


def past_the_reader(path: Path, tree: ast.Module) -> Iterator[str]:
    """Yield a line for each call that opens a file by its path: it may be a device, a pipe or too large."""
    if path.as_posix() in PAST_THE_READER:
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            if name == "shutil.copytree" and all(key.arg != "copy_function" for key in node.keywords):
                yield f"{path}:{node.lineno}: shutil.copytree copies devices and pipes; give copy_function"
            writes = any(isinstance(arg, ast.Constant) and str(arg.value)[:1] in "wax" for arg in node.args)
            if OPENS_A_PATH.search(name) and not READERS.search(name) and not writes:
                yield f"{path}:{node.lineno}: {name} opens a file past sealtwin.core.plain_files, which asks what it is"


def main() -> int:
    """Print every finding; return 1 if there is one."""
    findings: list[str] = []
    places: defaultdict[str, list[str]] = defaultdict(list)
    for path, tree in modules():
        findings.extend(fragments(path, tree))
        findings.extend(vague_names(path, tree))
        findings.extend(past_the_reader(path, tree))
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(f"{path}:{node.lineno}")
    for path, tree in modules(BESIDE):
        findings.extend(vague_names(path, tree, PARTICIPLES))
    findings.extend(f"{', '.join(at)}: {name} is defined {len(at)} times" for name, at in places.items() if len(at) > 1)
    print("\n".join(findings) or "No fragment, no vague name, no type twice; one reader opens all files.")  # noqa: T201
    return bool(findings)


if __name__ == "__main__":
    sys.exit(main())
