"""A film of a run, made from its frames."""

from pathlib import Path

from sealtwin.errors import InputError
from sealtwin.output import FRAMES
from sealtwin.progress import Progress
from sealtwin.store import files, stage_files
from sealtwin.store.folder import MANIFEST
from sealtwin.store.vtk_files import read_collection, read_frame


def make_film(folder: Path, path: Path, progress: Progress) -> tuple[int, float]:
    """Write ``path`` from the frames of a run folder; how many they are, and how long the film is, in seconds.

    Raises InputError where there are no frames.
    """
    if not (folder / MANIFEST).is_file():
        raise InputError(f"{folder}: no run folder (it has no {MANIFEST}). 'sealtwin run TRIAL' makes one.")
    if not (folder / FRAMES).is_file():
        raise InputError(
            f"{folder / FRAMES}: not found. 'sealtwin simulate {folder} --frames-every-s 0.1' runs the fluid again and "
            "writes frames."
        )
    from validate.drawing.snapshots import Scene
    from validate.film import write_film

    outline, solid, trajectory = (
        stage_files.read_outline(folder),
        stage_files.read_solid(folder),
        stage_files.read_trajectory(folder),
    )
    with files.understood(folder / "simulation.json"):
        run = files.read_json(folder / "simulation.json")
        scene = Scene(outline, solid, trajectory, run["radius_mm"], run["settings"]["nozzle"]["diameter_mm"])
    frames = read_collection(folder / FRAMES)
    progress.start("Filming", len(frames))
    write_film(path, [t_s for t_s, _ in frames], lambda number: read_frame(frames[number][1]), scene, progress.advance)
    return len(frames), frames[-1][0] - frames[0][0]
