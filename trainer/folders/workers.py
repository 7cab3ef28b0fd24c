"""Where the jobs of a folder run: here, some at a time, or on the workers of a Dask cluster."""

from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

from ...model.errors import UserError
from ...model.files import show
from .job import Job, News, Outcome, Runner, Status, run_job

PATIENCE = 10.0
"""Seconds that a cluster has to answer."""
WAKE = 0.2
"""Seconds between two looks at what is done, so that Ctrl-C is heard."""


def here(jobs: Sequence[Job], at_once: int, news: News) -> Generator[Outcome]:
    """Run jobs on this machine, and yield what comes of each as it comes.

    at_once: how many run beside one another. Where the caller closes this, or Ctrl-C ends it, those that run save what
    they have learnt.
    """
    runner = Runner(news)
    with ThreadPoolExecutor(at_once) as pool:
        waiting = {pool.submit(runner.run, job) for job in jobs}
        try:
            while waiting:
                done, waiting = wait(waiting, WAKE, FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            for future in waiting:
                future.cancel()
            runner.stop()


def on_cluster(jobs: Sequence[Job], address: str) -> Generator[Outcome]:
    """Run jobs on the workers of a Dask cluster, which see the same files, and yield what comes of each as it comes.

    address: of the scheduler, "tcp://host:8786". A job whose worker is lost runs again on another one, which goes on
    from what the lost one has kept. Raises UserError where no scheduler answers.
    """
    from dask import config
    from distributed import Client, as_completed

    try:
        with config.set({"distributed.comm.timeouts.connect": PATIENCE}):
            client: Any = Client(address, timeout=PATIENCE)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else "no answer"
        raise UserError(f"--cluster {show(address)}: no Dask scheduler answers there ({show(reason)[:120]})") from None
    with client:
        futures = {client.submit(run_job, job, pure=False, key=f"mplicits-{job.name}-{id(job)}"): job for job in jobs}
        for future in as_completed(futures):  # type: ignore[no-untyped-call]
            job = futures[future]
            if future.status == "finished":
                yield future.result()
            else:
                yield Outcome(
                    job, Status.FAILED, 0.0, f"its workers were lost ({show(repr(future.exception()))[:120]})"
                )
