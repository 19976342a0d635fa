"""Studies: many variants of one machine file, at the poses of that file.

What is varied (`varied_keys`) is laid out in a plan (`design`, `plan`), whose blocks of variants
are evaluated one by one (`block`), each a pure function of what it is handed (`base_machine`).
Results go into a store block by block (`store`), so that a study that was broken off goes on.
"""
