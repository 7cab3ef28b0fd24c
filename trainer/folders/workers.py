"""Runs the jobs of a folder on this machine, or on the workers of a Dask cluster."""

import logging
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, ThreadPoolExecutor, wait
from typing import Any

from ...model.errors import UserError
from ...model.files import show
from .job import Job, Outcome, Progress, Runner, Status, run_job

CONNECT_TIMEOUT = 10.0
"""Seconds that the scheduler of a cluster has to answer."""
POLL = 0.2
"""Seconds between two checks for finished jobs; Ctrl-C takes effect at the next check."""


def here(jobs: Sequence[Job], parallel: int, progress: Progress) -> Generator[Outcome]:
    """Run jobs on this machine, `parallel` at a time, and yield each outcome when its job ends.

    When the caller closes the generator, or presses Ctrl-C, running jobs save their state and end.
    """
    runner = Runner(progress)
    with ThreadPoolExecutor(parallel) as pool:
        waiting = {pool.submit(runner.run, job) for job in jobs}
        try:
            while waiting:
                done, waiting = wait(waiting, POLL, FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            for future in waiting:
                future.cancel()
            runner.stop()


def on_cluster(jobs: Sequence[Job], address: str) -> Generator[Outcome]:
    """Run jobs on the workers of a Dask cluster, which see the same files, and yield each outcome when its job ends.

    address: the scheduler's, "tcp://host:8786". When a worker is lost, another worker continues its job from the saved
    state. Raises UserError if no scheduler answers, or the scheduler is gone before all jobs ended.
    """
    from dask import config
    from distributed import Client, as_completed

    logging.disable()  # Dask and its libraries log a dying scheduler in dozens of lines.
    try:
        try:
            with config.set({"distributed.comm.timeouts.connect": CONNECT_TIMEOUT}):
                client: Any = Client(address, timeout=CONNECT_TIMEOUT)  # type: ignore[no-untyped-call]
        except Exception as error:  # The address chooses the library that raises.
            reason = str(error).splitlines()[0] if str(error) else "no answer"
            text = f"--cluster {show(address)[:200]}: no Dask scheduler answers there ({show(reason)[:120]})"
            raise UserError(text) from None
        with client:
            names = {job: f"mplicits-{job.name}-{id(job)}" for job in jobs}
            futures = {client.submit(run_job, job, pure=False, key=name): job for job, name in names.items()}
            for future in as_completed(futures):  # type: ignore[no-untyped-call]
                job = futures[future]
                match future.status:
                    case "finished":
                        yield future.result()
                    case "error":
                        yield _lost(job, future.exception())
                    case _:  # cancelled, because the client is closed
                        raise CancelledError
    except (OSError, TimeoutError, CancelledError, AsyncCancelledError):
        raise UserError(f"--cluster {show(address)}: the scheduler is gone; --resume trains the rest") from None
    finally:
        logging.disable(logging.NOTSET)


def _lost(job: Job, error: BaseException | None) -> Outcome:
    return Outcome(job, Status.FAILED, 0.0, f"its workers were lost ({show(repr(error))[:120]})")
