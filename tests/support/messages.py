"""A progress that keeps what a command says."""

from sealtwin.core.progress import Progress


class Narration(Progress):
    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        self.notes.append(text)
