"""The part: what the errors of a machine make of the workpiece that a program asks for.

A sample is one machine, and it goes to every point of the part: what all points share moves the
part and leaves its sizes as they are. Process effects (cutter, extrusion, clamping) are not in it.
"""
