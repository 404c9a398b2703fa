"""Remake the record of stages whose number was raised, or whose outputs came or went.

    python -m tests.stage_record

Refuses, with exit code 1 and without writing, while an output moved and its stage's number did not.
"""

import sys

from benchmarks.kept_runs import PARTS
from tests.stage_record import record


def main() -> int:
    recorded, faults, remade = record.read(), list[str](), dict[str, record.StageRecord]()
    for stage, number in PARTS.items():
        now, before = record.outputs_of(stage), recorded.get(stage)
        if before is not None and (fault := record.fault_of(stage, before, number, now)):
            faults.append(fault)
            continue
        why = "no record" if before is None else record.out_of_date(before, number, now)
        if why:
            remade[stage] = record.measured(stage, number)
        sys.stdout.write(f"{stage} {number}: {f'remade, {why}' if why else 'as recorded'}\n")
    if faults:
        sys.stderr.write("\n".join([*faults, "Nothing was written.", ""]))
        return 1
    if remade:
        record.write({stage: remade.get(stage) or recorded[stage] for stage in PARTS})
    return 0


if __name__ == "__main__":
    sys.exit(main())
