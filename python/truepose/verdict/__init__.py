"""The verdict: whether a machine keeps the accuracy asked, one answer for every command.

`accuracy` is the function; `states` what is judged, `survey` and `search` what is known of it,
`engine` asks for proofs, `coverage` samples, `witness_file` writes the machine that says no.
"""
