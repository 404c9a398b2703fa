"""What a report has as tables, by their titles."""

from validate.evidence import Evidence
from validate.statements.agreement import agreement_table, readings_table
from validate.statements.health import health_table
from validate.statements.nozzle_path import path_table
from validate.statements.origin import settings_table
from validate.statements.sample import geometry_table
from validate.statements.sealant import balance_table
from validate.statements.table import Table


def tables(evidence: Evidence) -> list[Table]:
    compared = [] if evidence.comparison is None else [agreement_table(evidence), readings_table(evidence)]
    alone = (balance_table, health_table, geometry_table, path_table, settings_table)
    return [*compared, *(table(evidence) for table in alone)]


def rows(evidence: Evidence, title: str) -> dict[str, str]:
    return dict(next(table.rows for table in tables(evidence) if table.title == title))
