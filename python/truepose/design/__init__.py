"""Design: which tolerances, materials and stiffnesses keep an accuracy at least cost.

The unknowns are one grade a tie and one option a choice (`space`). Of a machine with its options
set, the largest error to first order at a pose, in a condition, along a direction is linear in the
half widths (`error_model`): a cut. An integer programme of cuts (`programme`) gives the cheapest
design that they allow, a judge (`judge`) looks where that design errs most, by the exact machine,
and adds cuts there, until there is nothing to add (`option_combination`, `search`). The verdict is
asked at the worst poses (`allocate`); a design is written as a machine file (`design_file`).

For a share of all machines the cuts are of quantiles, which follow from variances
(`statistical_judge`, `statistical_search`, `statistical_allocation`); machines drawn anew have to
show it (`shares_kept`). All over the box a design is proven by bounds (`region_proof`).
"""
