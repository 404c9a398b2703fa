"""Files of digitised runs for other programs: masks and COCO annotations for training, drawings for CAD."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Trajectory
from sealtwin.core.run_folder import look_into, require_folder
from sealtwin.trial.trial_file import load_trial

ExportKind = Literal["mask", "coco", "dxf"]
KINDS: tuple[ExportKind, ...] = get_args(ExportKind)
COCO = "coco.json"


def export_runs(folders: Sequence[Path], kinds: Sequence[ExportKind], out: Path) -> list[Path]:
    """Write a mask and a drawing for each run and one COCO file for all into ``out``; return the files.

    Raises InputError, before the first file, if a run is not digitised or shows what a kind cannot hold, or a file of
    the name is there that holds anything else.
    """
    require_folder(out)
    names, trials, outlines, paths = list[str](), list[str](), list[Outline](), list[Trajectory]()
    for folder in folders:
        if look_into(folder).settings_of("digitise") is None:
            raise InputError(f"{folder}: digitise is not finished. Run 'sealtwin run TRIAL --out {folder}' first.")
        trial = load_trial(folder / "trial.toml")
        names.append(trial.shown_by.file.name)
        trials.append(trial.name)
        outlines.append(record_files.read_outline(folder))
        paths.append(record_files.read_trajectory(folder))
    counts = Counter(names)
    # Ingest gives each sample's photo the same name; the trial then has the sample's.
    names = [
        name if counts[name] == 1 else f"{trial}{Path(name).suffix}" for name, trial in zip(names, trials, strict=True)
    ]
    stems = [Path(name).stem for name in names]
    if twice := [stem for stem, times in Counter(stems).items() if times > 1]:
        raise InputError(
            f"{twice[0]}: several runs are of files and trials of that name; export them into folders of their own."
        )
    contents: dict[Path, bytes] = {}
    for name, stem, outline, path in zip(names, stems, outlines, paths, strict=True):
        if "mask" in kinds:
            from digitise.image.labels import mask_png

            contents[out / f"{stem}_mask.png"] = mask_png(outline, name)
        if "dxf" in kinds:
            from digitise.drawing.write_dxf import dxf_text

            contents[out / f"{stem}.dxf"] = dxf_text(outline, path).encode()
    if "coco" in kinds:
        from digitise.image.labels import coco_of

        contents[out / COCO] = files.as_json(coco_of(list(zip(names, outlines, strict=True)))).encode()
    files.write_unless_other(contents)
    return list(contents)
