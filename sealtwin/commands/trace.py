"""Show a photo in the browser, and take down where its crack is."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sealtwin.answering import INTERRUPTED, Json, Quiet, answering
from sealtwin.errors import InputError

if TYPE_CHECKING:
    from digitise.trace_page.page import Save
    from digitise.trace_page.session import TraceSession


def trace(
    target: Annotated[Path, typer.Argument(metavar="TRIAL|PHOTO", help="A trial.toml, or a photo without one.")],
    port: Annotated[
        int | None, typer.Option(min=1024, max=65535, help="Of the page; default: any that is free.")
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the page's address.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Click a crack's ends on its photo, see its walls, and save the clicks.

    Opens a page in your browser that only this machine can reach; it ends when you save or quit there.
    A trial keeps all but the hints for its photo; beside a photo, a new trial is written.
    """
    with answering("cpu", as_json, quiet) as command:
        import webbrowser

        from digitise.trace_page.page import TracePage

        session, save, facts = _of_trial(target) if target.suffix.lower() == ".toml" else _of_photo(target)
        try:
            page = TracePage(session, save, facts=facts, port=port or 0)
        except OSError as fault:
            raise InputError(
                f"--port {port}: {fault.strerror}. Give another one, or none for any that is free."
            ) from None
        with page:
            # Said even when quiet: nothing else tells where the page is.
            typer.echo(f"Trace page: {page.url}", err=True)
            command.say("It ends when you save or quit there, or with Ctrl-C here.")
            if not no_browser and not webbrowser.open(page.url):
                command.say("No browser could be opened; open that address yourself.")
            try:
                saved = page.wait()
            except KeyboardInterrupt:
                command.fail("interrupted; nothing was saved.", INTERRUPTED)
        if saved is None:
            command.answer({"version": 1, "saved": None, "changed": []}, ["Nothing was saved."])
        else:
            answer = {"version": 1, "saved": saved["file"], "changed": saved["changed"]}
            command.answer(answer, [saved["summary"], f"Next: {saved['next']}"])


def _of_trial(path: Path) -> "tuple[TraceSession, Save, dict[str, Any]]":
    from digitise.trace_page.hints import Hints
    from digitise.trace_page.session import TraceSession
    from sealtwin.trials.hints import TrialFile
    from sealtwin.trials.trial import load_trial

    settings = load_trial(path).photo
    if settings is None:
        raise InputError(f"{path}: this trial starts from a mesh; there is no photo to trace.")
    trial = TrialFile(path)

    def save(hints: Hints, _: float | None) -> dict[str, Any]:
        return _saved(path, trial.save(hints))

    facts = {"needs_depth": False, "saves_to": f"Saves into {path.name}, and keeps its comments."}
    return TraceSession(settings, path.parent, Hints.of(settings)), save, facts


def _of_photo(path: Path) -> "tuple[TraceSession, Save, dict[str, Any]]":
    from digitise.settings import PhotoInput
    from digitise.trace_page.hints import UNSCALED_MM_PER_PX, Hints
    from digitise.trace_page.session import TraceSession
    from sealtwin.trials.hints import NewTrial

    trial = NewTrial(path)
    settings = PhotoInput(file=Path(path.name), data="measured", mm_per_px=UNSCALED_MM_PER_PX)

    def save(hints: Hints, depth_mm: float | None) -> dict[str, Any]:
        return _saved(trial.path, trial.save(hints, depth_mm))

    facts = {"needs_depth": True, "saves_to": f"Writes {trial.path.name} beside the photo."}
    return TraceSession(settings, path.parent, Hints()), save, facts


def _saved(path: Path, changed: list[str]) -> dict[str, Any]:
    keys = ", ".join(changed) if changed else "nothing had changed"
    return {
        "file": str(path),
        "changed": changed,
        "summary": f"Saved into {path}: {keys}.",
        "next": f"sealtwin digitise {shlex.quote(str(path))}",
    }
