"""Files of runs for other programs: masks and COCO annotations for training, drawings for CAD, films."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import look_into, require_folder
from sealtwin.core.vtk_files import read_collection, read_frame
from sealtwin.trial.job import require_digitised
from sealtwin.trial.simulate_stage import FRAMES
from sealtwin.trial.trial_file import load_trial

ExportKind = Literal["mask", "coco", "dxf"]
KINDS: tuple[ExportKind, ...] = get_args(ExportKind)
COCO = "coco.json"


def export_runs(folders: Sequence[Path], kinds: Sequence[ExportKind], out: Path) -> list[Path]:
    """Write a mask and a drawing for each run, and one COCO file for all, into ``out``; return the files.

    Raises InputError, before writing any file, if a run is not digitised or cannot be written in a format, or a file of
    the same name exists with another content.
    """
    from digitise.exports import coco_of, dxf_text, mask_png

    require_folder(out)
    for folder in folders:
        require_digitised(look_into(folder))
    trials = [load_trial(folder / "trial.toml") for folder in folders]
    names = [trial.shown_by.file.name for trial in trials]
    counts = Counter(names)
    # Ingest gives the photo of each sample the same name; the name of the trial is that of the sample.
    names = [
        name if counts[name] == 1 else f"{trial.name}{Path(name).suffix}"
        for name, trial in zip(names, trials, strict=True)
    ]
    if twice := [stem for stem, times in Counter(Path(name).stem for name in names).items() if times > 1]:
        raise InputError(
            f"{twice[0]}: several runs have files and trials of this name; export them into separate folders."
        )
    outlines = {name: record_files.read_outline(folder) for name, folder in zip(names, folders, strict=True)}
    contents: dict[Path, bytes] = {}
    for (name, outline), folder in zip(outlines.items(), folders, strict=True):
        stem = Path(name).stem
        if "mask" in kinds:
            contents[out / f"{stem}_mask.png"] = mask_png(outline, name)
        if "dxf" in kinds:
            contents[out / f"{stem}.dxf"] = dxf_text(outline, record_files.read_trajectory(folder)).encode()
    if "coco" in kinds:
        contents[out / COCO] = files.as_json(coco_of(list(outlines.items()))).encode()
    files.write_unless_other(contents)
    return list(contents)


def make_film(folder: Path, path: Path, progress: Progress) -> tuple[int, float]:
    """Write a film of a run folder's frames; return their number and the simulated time in seconds.

    Raises InputError if frames are missing.
    """
    look_into(folder)
    if not (folder / FRAMES).is_file():
        raise InputError(
            f"{folder / FRAMES}: not found. 'sealtwin simulate {folder} --set output.frames_every_s=0.1' writes "
            "frames, and computes the fluid run again."
        )
    from validate.figures.snapshots import FillScene, write_film

    outline, solid = record_files.read_outline(folder), record_files.read_solid(folder)
    run = record_files.read_simulation(folder)
    with files.understood(folder / "simulation.json"):
        nozzle_mm = float(files.read_json(folder / "simulation.json")["settings"]["nozzle"]["diameter_mm"])
    scene = FillScene(outline, solid, record_files.read_trajectory(folder), run.radius_mm, nozzle_mm)
    frames = read_collection(folder / FRAMES)
    progress.start("Filming", len(frames))
    write_film(path, [t_s for t_s, _ in frames], lambda number: read_frame(frames[number][1]), scene, progress.advance)
    return len(frames), frames[-1][0] - frames[0][0]
