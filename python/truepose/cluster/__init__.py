"""Other processes that compute, by dask.distributed: whole blocks, with the bits of this one.

`options.py` says what is asked for, `workers.py` finds the workers and which of them may compute,
`hand_out.py` hands them tasks, `in_worker.py` is what runs there. What a task is nobody knows here.
"""
