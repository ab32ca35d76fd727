"""The queue of long work: every job gets its own answer, or none."""

import asyncio
from pathlib import Path

from thrustd.workbench.jobs import JobBoard


def _board(folder: Path) -> JobBoard:
    kept = folder / ".thrustd"
    kept.mkdir()
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text("time_s,force_N\n0,1\n1,2\n2,3\n")
    return JobBoard(folder, kept)


def test_a_job_that_is_cancelled_while_its_worker_starts_leaves_its_answer_to_nobody(tmp_path):
    board = _board(tmp_path)

    async def asked():
        working = asyncio.create_task(board.run())
        while board._worker is None:
            await asyncio.sleep(0.01)
        board._kill()  # as another job that is cancelled does
        try:
            first = board.add("prepare", "b", {"recording": "b.csv"})
            while board.job(first.id).state != "running":
                await asyncio.sleep(0)
            board.cancel(first.id)
            second = board.add("prepare", "a", {"recording": "a.csv"})
            while not board.job(second.id).over:
                await asyncio.sleep(0.02)
        finally:
            worker = board._worker
            working.cancel()
            await asyncio.gather(working, return_exceptions=True)
            await worker.wait()
        return board.job(first.id), board.job(second.id)

    first, second = asyncio.run(asked())
    assert (first.state, first.result) == ("cancelled", {})
    assert (second.state, second.result["recording"]) == ("done", "a.csv")


def test_what_a_worker_says_of_a_cancelled_job_counts_no_more(tmp_path):
    board = _board(tmp_path)
    job = board.add("prepare", "a", {"recording": "a.csv"})
    board.cancel(job.id)
    board._hear(job.id, {"done": {"recording": "a.csv"}})
    assert board.job(job.id).state == "cancelled"
