"""What a result comes from: its photo, its settings, its versions and inputs."""

from validate.evidence import Evidence
from validate.statements.table import Table
from validate.wording import plain, words


def photo_caption(evidence: Evidence) -> str:
    seen_in = evidence.outline.seen_in
    return (
        f"The walls and the centreline that were found, over the {seen_in}. {seen_in.capitalize()}: "
        f"{evidence.photo_data}. Scale: {evidence.outline.scale_source}."
    )


def settings_table(evidence: Evidence) -> Table:
    rows = []
    for group, content in evidence.run.settings.items():
        if isinstance(content, dict):
            rows += [(f"{group}: {words(key)}", plain(value)) for key, value in content.items() if value is not None]
        else:
            rows.append((group, plain(content)))
    return Table("Settings in effect", tuple(rows))


def provenance_table(evidence: Evidence) -> Table:
    return Table("Versions and inputs", tuple(evidence.provenance.items()))
