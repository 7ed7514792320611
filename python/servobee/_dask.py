"""A batch on the workers of Dask."""

from . import _servobee
from ._errors import refused

# Tasks for each thread of the workers: so many that none waits long for the last one, so few that each has several files.
TASKS = 8


def on_workers(client, files, out, said, progress):
    """Takes the files of a batch as tasks on the workers of `client`, which go on where one that died was cut off."""
    from distributed import as_completed

    if "task" in said:
        raise refused("task", "is a part of the work, and a client does all of it", "leave one of the two out")
    if not said.get("resume"):
        _servobee.begin_batch(out, said)
    count = TASKS * max(1, sum(client.nthreads().values()))
    parts = [said | {"task": f"{number}/{count}"} for number in range(1, count + 1)]
    tasks = [client.submit(_take, files, out, part, pure=False, retries=2) for part in parts]
    try:
        for done, task in enumerate(as_completed(tasks), 1):
            task.result()
            if progress is not None:
                progress(f"{done}/{count} tasks")
    finally:
        client.cancel(tasks)


def _take(files, out, said):
    # What has to be said of a file that failed is said when it is tried again, in the end.
    _servobee.batch(files, out, said, None)
