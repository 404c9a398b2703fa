"""The tables of a report, by their titles."""

from validate.report_input import Evidence
from validate.units import PageTable
from validate.wording.comparison import agreement_table, balance_table, readings_table
from validate.wording.sample_and_run import geometry_table, health_table, path_table, settings_table


def tables(evidence: Evidence) -> list[PageTable]:
    compared = []
    if evidence.comparison is not None and evidence.readings is not None:
        compared = [
            agreement_table(evidence.comparison),
            readings_table(evidence.readings, evidence.comparison, evidence.sheet),
        ]
    alone = (balance_table, health_table, geometry_table, path_table, settings_table)
    return [*compared, *(table(evidence) for table in alone)]


def rows(evidence: Evidence, title: str) -> dict[str, str]:
    return dict(next(table.rows for table in tables(evidence) if table.title == title))
