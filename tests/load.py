"""A hundred records of a million rows in one call of identify, within 8 GiB.

    python3 tests/load.py target/release/servobee [RECORDS]

One record is made by the simulator; the others are copies of it, so that making them takes seconds.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time

LIMIT = 8 * 1024**3

servobee = os.path.abspath(sys.argv[1])
count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
with tempfile.TemporaryDirectory(dir="target") as folder:
    record = os.path.join(folder, "record.csv")
    make = [servobee, "synthesize", "--seconds", "1000", "--effect", "hysteresis=2", "--out", record]
    subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
    records = [record]
    for number in range(1, count):
        records.append(os.path.join(folder, f"record{number}.csv"))
        os.link(record, records[-1])
    begun = time.monotonic()
    out = os.path.join(folder, "out")
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (LIMIT, LIMIT))
    ran = subprocess.run([servobee, "identify", *records, "--out", out, "--evaluator", "cpu"], preexec_fn=limit)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024**2
    print(f"{count} records of 1 000 000 rows: exit {ran.returncode}, {time.monotonic() - begun:.0f} s, {peak:.2f} GiB at most")
    if ran.returncode != 0 or not os.path.exists(os.path.join(out, "report.json")):
        sys.exit(1)
